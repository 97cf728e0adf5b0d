//! The image: wires the tasks to the library.
//!
//! | task | priority | released by |
//! |---|---|---|
//! | `receive` | 5 | each byte on the link |
//! | `control` | 4 | SysTick; in lock step `state_input`, when the host asks for a tick |
//! | `state_input` | 3 | `control` at each tick, `receive` at the end of a frame |
//! | `telemetry`, `housekeeping` | 2, 1 | `control`, when due |
//!
//! In lock step the lowest of these tells the host that nothing is left to do.
//!
//! The lower groups are bound to interrupts of peripherals that no board uses, and pended by
//! software: no executor, no waker, every call direct, so the stack can be bounded statically.
//! `receive` is above control because a byte must be taken within 5 us; it moves one byte.
#![no_std]
#![no_main]

#[cfg(not(feature = "emulator"))]
use defmt_rtt as _;
#[cfg(feature = "emulator")]
use defmt_semihosting as _;

#[rtic::app(device = stm32f4xx_hal::pac, peripherals = true)]
mod app {
    use core::sync::atomic::Ordering::Relaxed;

    use cortex_m::peripheral::SCB;
    use ctrl_core::mode::Mode;
    use firmware::board::peripherals::{
        Peripherals, Rotors, WATCHDOG_TIMEOUT, now, start_control_tick,
    };
    use firmware::board::{Active, Board, ROTORS};
    use firmware::exchange::{Inbox, Outbox, health};
    use firmware::fault::{UPTIME, fault_before_boot};
    use firmware::flight_control::FlightControl;
    use firmware::pace::{Begin, Pace};
    use firmware::parameter_store::{Found, ParameterStore};
    use firmware::rate_loop::{Due, Group, RateLoop};
    use firmware::scenario::BuiltInMission;
    use firmware::session::{PaceRequest, Progress, Session, SessionConfig};
    use firmware::stored_parameters::{SetError, put_in_force};
    use firmware::{rates, scenario, vehicle};
    use heapless::spsc::{Consumer, Producer, Queue};
    use link::{
        Decoder, Downlink, Encoder, Health, LinkStatistics, MAX_FRAME, ParametersInForce, Uplink,
    };
    use stm32f4xx_hal::pac::{Interrupt, USART2};
    use stm32f4xx_hal::prelude::*;
    use stm32f4xx_hal::serial::{Rx, Tx};
    use stm32f4xx_hal::watchdog::IndependentWatchdog;

    /// Bytes that may wait for `state_input`: two ticks of the link at full rate.
    const RECEIVED: usize = 512;
    /// Answers that one release of `telemetry` sends at most.
    const ANSWERS_A_RELEASE: usize = 2;

    #[shared]
    struct Shared {
        rate_loop: RateLoop,
        pace: Pace,
        inbox: Inbox,
        outbox: Outbox,
        session: &'static mut Session,
        link: LinkStatistics,
        health: Option<Health>,
        transmitter: Transmitter,
    }

    #[local]
    struct Local {
        flight: FlightControl,
        rotors: Rotors,
        receiver: Rx<USART2>,
        received_in: Producer<'static, u8>,
        received_out: Consumer<'static, u8>,
        decoder: Decoder<Uplink>,
        telemetry_timing: (bool, u16),
        watchdog: IndependentWatchdog,
        store: ParameterStore<<Active as Board>::Storage>,
        logged: Logged,
    }

    /// Sends messages to the host.
    pub struct Transmitter {
        wire: Tx<USART2>,
        encoder: Encoder<Downlink>,
    }

    impl Transmitter {
        /// Sends one message; returns the time that the wire took (us).
        fn send(&mut self, message: &Downlink) -> u32 {
            let mut frame = [0; MAX_FRAME];
            // Every message of the core fits a frame (tested there).
            let Ok(frame) = self.encoder.encode(message, &mut frame) else { return 0 };
            let start = now();
            Active::transmit(&mut self.wire, frame);
            now().wrapping_sub(start)
        }
    }

    /// What the log has said last.
    #[derive(Default)]
    pub struct Logged {
        mode: Mode,
        overruns: [u32; 4],
    }

    /// The session is built in place: it holds a whole path, and moving it costs stack.
    #[init(local = [queue: Queue<u8, RECEIVED> = Queue::new(), session: Option<Session> = None])]
    fn init(mut cx: init::Context) -> (Shared, Local) {
        // build.rs has checked all of these: an error means a damaged image.
        let (Ok(vehicle), Ok(mut flown)) =
            (vehicle::vehicle_config(), scenario::built_in_mission())
        else {
            panic!("damaged configuration");
        };
        let mut thrust_max = [0.0; ROTORS];
        for (max, rotor) in thrust_max.iter_mut().zip(&vehicle.geometry.rotors) {
            *max = rotor.thrust.upper;
        }
        let mut peripherals = Peripherals::new(cx.device, &mut cx.core, thrust_max);
        let fault = fault_before_boot(peripherals.watchdog_reset);
        if let Some(report) = &fault {
            firmware::fault::log(report);
            Active::report(report);
        }
        // May erase, which takes most of a second: the control loop has not begun.
        let (store, found) = ParameterStore::open(peripherals.storage);
        let in_force = parameters_in_force(&mut flown, &found);
        let config = SessionConfig::new(Active::NAME, Active::TELEMETRY_PERIOD_MIN, &vehicle);
        let session =
            cx.local.session.insert(match Session::new(config, &flown, in_force, fault) {
                Ok(session) => session,
                Err(_) => panic!("damaged scenario"),
            });
        let flight = FlightControl::new(session.law(), &vehicle.supervisor, &vehicle.geometry);
        let Ok(flight) = flight else { panic!("damaged vehicle") };
        let inbox = Inbox {
            vehicle: None,
            reference: session.reference(Progress::default()),
            command: None,
            law: None,
            fault: session.fault_pending(),
        };
        let (received_in, received_out) = cx.local.queue.split();
        defmt::info!(
            "{=str}: scenario {=str}, control at {=u32} Hz",
            Active::NAME,
            scenario::BUILT_IN,
            scenario::CONTROL_RATE
        );
        peripherals.watchdog.start(WATCHDOG_TIMEOUT.millis());
        start_control_tick(&mut cx.core.SYST, scenario::CONTROL_RATE);
        (
            Shared {
                rate_loop: rates::RATE_LOOP,
                pace: rates::pace(Active::lock_step_timeout()),
                inbox,
                outbox: Outbox::default(),
                session,
                link: LinkStatistics::default(),
                health: None,
                transmitter: Transmitter {
                    wire: peripherals.transmitter,
                    encoder: Encoder::default(),
                },
            },
            Local {
                flight,
                rotors: peripherals.rotors,
                receiver: peripherals.receiver,
                received_in,
                received_out,
                decoder: Decoder::default(),
                telemetry_timing: (false, 0),
                watchdog: peripherals.watchdog,
                store,
                logged: Logged::default(),
            },
        )
    }

    /// Flies with what was found in memory, if it is accepted, and logs it.
    fn parameters_in_force(flown: &mut BuiltInMission, found: &Found) -> ParametersInForce {
        let (in_force, result) = put_in_force(flown, found);
        let (origin, generation) = (in_force.origin as u8, in_force.generation);
        defmt::info!("parameters of origin {=u8}, generation {=u32}", origin, generation);
        if let Err(SetError::Invalid(error)) = result {
            defmt::warn!("stored {=str} = {=f32} refused", error.parameter, error.value);
        }
        in_force
    }

    #[idle]
    fn idle(_: idle::Context) -> ! {
        loop {
            Active::idle();
        }
    }

    /// One byte from the wire; a full queue drops it, and the frame's checksum tells.
    #[task(binds = USART2, priority = 5, local = [receiver, received_in])]
    fn receive(cx: receive::Context) {
        let mut ended = false;
        Active::receive(cx.local.receiver, |byte| {
            let _ = cx.local.received_in.enqueue(byte);
            ended |= byte == 0;
        });
        if ended {
            rtic::pend(Interrupt::SPI1);
        }
    }

    /// Supervision, law, rotors; then releases what is due.
    #[task(binds = SysTick, priority = 4, shared = [rate_loop, pace, inbox, outbox],
           local = [flight, rotors])]
    fn control(cx: control::Context) {
        let control::SharedResources { mut rate_loop, mut pace, mut inbox, mut outbox, .. } =
            cx.shared;
        let (flight, rotors) = (cx.local.flight, cx.local.rotors);
        let begin = pace.lock(|pace| pace.begin());
        let in_step = match begin {
            Begin::Wait => return,
            Begin::Feed => return rtic::pend(Interrupt::SPI3),
            Begin::Step => true,
            Begin::Tick => false,
            Begin::Leave => {
                flight.disarm();
                inbox.lock(|inbox| inbox.disarm());
                rate_loop.lock(|rate_loop| rate_loop.resume());
                false
            }
        };
        let (due, overrun, uptime) = rate_loop.lock(|rate_loop| {
            let due = if in_step { rate_loop.step(now()) } else { rate_loop.tick(now()) };
            let overrun = rate_loop.control_overran() || rate_loop.failsafe_required();
            (due, overrun, rate_loop.ticks())
        });
        UPTIME.store(uptime, Relaxed);
        let start = Active::cost();
        let (inputs, law) = inbox.lock(|inbox| inbox.take(overrun, in_step));
        if let Some(law) = law {
            flight.replace_law(law);
        }
        let outputs = flight.tick(&inputs);
        match outputs.thrusts.as_ref().and_then(|thrusts| thrusts.first_chunk()) {
            Some(thrusts) if !in_step => rotors.command(thrusts),
            _ => rotors.stop(),
        }
        let cost = Active::cost().wrapping_sub(start);
        outbox.lock(|outbox| {
            let (mode, flight_tick) = (outputs.mode, outputs.flight_tick);
            outbox.progress = Progress { mode, flight_tick, uptime, in_step };
            outbox.answer = outputs.answer.or(outbox.answer);
            if due.contains(Group::Telemetry) {
                outbox.telemetry = Some(flight.telemetry(&outputs, cost));
            }
        });
        Active::exercise(uptime);
        release(due);
        if in_step {
            rtic::pend(Interrupt::SPI3);
        }
        rate_loop.lock(|rate_loop| rate_loop.finish(Group::Control, now()));
    }

    /// Pends the lower groups that are due.
    fn release(due: Due) {
        if due.contains(Group::StateInput) {
            rtic::pend(Interrupt::SPI1);
        }
        if due.contains(Group::Telemetry) {
            rtic::pend(Interrupt::SPI2);
        }
        if due.contains(Group::Housekeeping) {
            rtic::pend(Interrupt::SPI3);
        }
    }

    /// Hears the host and prepares the inputs of the next tick.
    #[task(binds = SPI1, priority = 3, shared = [rate_loop, pace, inbox, outbox, session, link],
           local = [received_out, decoder, telemetry_timing])]
    fn state_input(cx: state_input::Context) {
        let state_input::SharedResources { mut rate_loop, mut inbox, mut outbox, .. } = cx.shared;
        let (mut session, mut link, mut pace) = (cx.shared.session, cx.shared.link, cx.shared.pace);
        let state_input::LocalResources { received_out, decoder, telemetry_timing, .. } = cx.local;
        let (progress, answer) = outbox.lock(|outbox| (outbox.progress, outbox.answer.take()));
        let progress = Progress { in_step: pace.lock(|pace| pace.in_step()), ..progress };
        let (request, answers) = session.lock(|session| {
            if let Some(answer) = answer {
                session.answered(answer);
            }
            session.keep_pace(progress.in_step);
            for _ in 0..RECEIVED {
                let Some(byte) = received_out.dequeue() else { break };
                if let Some(received) = decoder.push(byte) {
                    session.handle(received, progress);
                }
            }
            let (sample, law) = (session.sample(progress.uptime), session.take_law());
            let (reference, fault) = (session.reference(progress), session.fault_pending());
            inbox.lock(|inbox| {
                (inbox.vehicle, inbox.reference, inbox.fault) = (sample, reference, fault);
                inbox.law = law.or(inbox.law);
                if inbox.command.is_none() {
                    inbox.command = session.next_command();
                }
            });
            let timing = (progress.in_step, session.telemetry_period());
            if *telemetry_timing != timing {
                *telemetry_timing = timing;
                let (period, deadline) = rates::telemetry_timing(timing.0, timing.1);
                // Every timing of `rates` is accepted (tested there).
                let _ = rate_loop.lock(|r| r.set_period(Group::Telemetry, period, deadline));
            }
            (session.take_pace_request(), session.has_answers())
        });
        link.lock(|link| *link = decoder.statistics());
        rate_loop.lock(|rate_loop| rate_loop.finish(Group::StateInput, now()));
        if let Some(request) = request {
            pace.lock(|pace| obey(pace, request, progress.uptime));
        } else if progress.in_step && answers {
            // A host that does not step yet is answered at once.
            rtic::pend(Interrupt::SPI2);
        }
    }

    /// Lets the host have its way with time.
    fn obey(pace: &mut Pace, request: PaceRequest, uptime: u32) {
        match request {
            PaceRequest::Enter => pace.enter(),
            PaceRequest::Leave => pace.leave(),
            PaceRequest::Step(wanted) if pace.ask(wanted, uptime) => return SCB::set_pendst(),
            PaceRequest::Step(_) => {}
        }
        // Without a tick nobody else sends the answers and tells the host.
        rtic::pend(Interrupt::SPI2);
        rtic::pend(Interrupt::SPI3);
    }

    /// Sends what the control group did, answers, and the health report.
    #[task(binds = SPI2, priority = 2,
           shared = [rate_loop, pace, outbox, session, health, transmitter])]
    fn telemetry(cx: telemetry::Context) {
        let telemetry::SharedResources { mut rate_loop, mut outbox, mut session, .. } = cx.shared;
        let (mut health, mut transmitter) = (cx.shared.health, cx.shared.transmitter);
        let mut pace = cx.shared.pace;
        let telemetry = outbox.lock(|outbox| outbox.telemetry.take());
        let (subscribed, greeted) =
            session.lock(|session| (session.telemetry_period() != 0, session.greeted()));
        let wire = transmitter.lock(|transmitter| {
            let mut wire = 0;
            if let (Some(telemetry), true) = (telemetry, subscribed) {
                wire += transmitter.send(&Downlink::Telemetry(telemetry));
            }
            for _ in 0..ANSWERS_A_RELEASE {
                let Some(answer) = session.lock(|session| session.next_answer()) else { break };
                wire += transmitter.send(&answer);
            }
            if let (Some(health), true) = (health.lock(Option::take), greeted) {
                wire += transmitter.send(&Downlink::Health(health));
            }
            wire
        });
        let in_step = pace.lock(|pace| pace.in_step());
        rate_loop.lock(|rate_loop| {
            if in_step {
                rate_loop.skip(wire);
            }
            rate_loop.finish(Group::Telemetry, now());
        });
        if !in_step {
            Active::exchange();
        }
    }

    /// Log, health report, stored parameters, watchdog; in lock step, tells the host that nothing is
    /// left to do.
    #[task(binds = SPI3, priority = 1,
           shared = [rate_loop, pace, outbox, session, link, health, transmitter],
           local = [watchdog, store, logged])]
    fn housekeeping(cx: housekeeping::Context) {
        let housekeeping::SharedResources { mut rate_loop, mut outbox, mut session, .. } =
            cx.shared;
        let (mut link, mut health_report) = (cx.shared.link, cx.shared.health);
        let (mut pace, mut transmitter) = (cx.shared.pace, cx.shared.transmitter);
        let progress = outbox.lock(|outbox| outbox.progress);
        let feed = if rate_loop.lock(|rate_loop| rate_loop.is_due(Group::Housekeeping)) {
            let link = link.lock(|link| *link);
            let dropped = session.lock(|session| session.dropped());
            let report = rate_loop.lock(|rate_loop| health(rate_loop, link, dropped));
            log(cx.local.logged, progress, &report);
            health_report.lock(|health| *health = Some(report));
            if let Some(parameters) = session.lock(|session| session.next_to_store()) {
                let result = cx.local.store.append(&parameters.encode());
                session.lock(|session| session.stored(result));
            }
            rate_loop.lock(|rate_loop| {
                rate_loop.finish(Group::Housekeeping, now());
                rate_loop.feed_watchdog()
            })
        } else {
            // The clock calls without a tick while lock step waits for its host.
            pace.lock(|pace| pace.in_step())
        };
        if feed {
            cx.local.watchdog.feed();
        }
        if pace.lock(|pace| pace.take_announcement()) {
            // Not what was read above: a tick may have passed since.
            let uptime_ticks = outbox.lock(|outbox| outbox.progress.uptime).into();
            transmitter.lock(|transmitter| transmitter.send(&Downlink::Stepped { uptime_ticks }));
            Active::exchange();
        }
    }

    /// Says what has changed.
    fn log(logged: &mut Logged, progress: Progress, health: &Health) {
        if logged.mode != progress.mode {
            logged.mode = progress.mode;
            defmt::info!("mode {=u8} at tick {=u32}", progress.mode as u8, progress.uptime);
        }
        for (group, (health, logged)) in health.groups.iter().zip(&mut logged.overruns).enumerate()
        {
            if *logged != health.overruns {
                *logged = health.overruns;
                defmt::warn!("group {=usize}: {=u32} overruns", group, health.overruns);
            }
            defmt::debug!("group {=usize}: worst {=u32} us", group, health.worst_time);
        }
    }
}
