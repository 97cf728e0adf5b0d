//! The image: wires the tasks to the library.
//!
//! | task | priority | released by |
//! |---|---|---|
//! | `receive` | 5 | each byte on the link |
//! | `control` | 4 | SysTick |
//! | `state_input` | 3 | `control` at each tick, `receive` at the end of a frame |
//! | `telemetry`, `housekeeping` | 2, 1 | `control`, when due |
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

    use ctrl_core::link::{
        Decoder, Downlink, Encoder, Health, LinkStatistics, MAX_FRAME, ParametersInForce, Uplink,
    };
    use ctrl_core::mode::Mode;
    use firmware::board::peripherals::{
        Peripherals, Rotors, WATCHDOG_TIMEOUT, now, start_control_tick,
    };
    use firmware::board::{Active, Board, ROTORS};
    use firmware::exchange::{Inbox, Outbox, health};
    use firmware::fault::{UPTIME, fault_before_boot};
    use firmware::flight_control::FlightControl;
    use firmware::parameter_store::{Found, ParameterStore};
    use firmware::rate_loop::{Due, Group, RateLoop};
    use firmware::scenario::Flown;
    use firmware::session::{Progress, Session, SessionConfig};
    use firmware::stored_parameters::{SetError, put_in_force};
    use firmware::{rates, scenario, vehicle};
    use heapless::spsc::{Consumer, Producer, Queue};
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
        inbox: Inbox,
        outbox: Outbox,
        session: &'static mut Session,
        link: LinkStatistics,
        health: Option<Health>,
    }

    #[local]
    struct Local {
        flight: FlightControl,
        rotors: Rotors,
        receiver: Rx<USART2>,
        received_in: Producer<'static, u8>,
        received_out: Consumer<'static, u8>,
        decoder: Decoder<Uplink>,
        telemetry_period: u16,
        transmitter: Tx<USART2>,
        encoder: Encoder<Downlink>,
        watchdog: IndependentWatchdog,
        store: ParameterStore<<Active as Board>::Storage>,
        logged: Logged,
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
        let (Ok(vehicle), Ok(mut flown)) = (vehicle::vehicle_config(), scenario::flown()) else {
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
            scenario::FLOWN,
            scenario::CONTROL_RATE
        );
        peripherals.watchdog.start(WATCHDOG_TIMEOUT.millis());
        start_control_tick(&mut cx.core.SYST, scenario::CONTROL_RATE);
        (
            Shared {
                rate_loop: rates::RATE_LOOP,
                inbox,
                outbox: Outbox::default(),
                session,
                link: LinkStatistics::default(),
                health: None,
            },
            Local {
                flight,
                rotors: peripherals.rotors,
                receiver: peripherals.receiver,
                received_in,
                received_out,
                decoder: Decoder::default(),
                telemetry_period: 0,
                transmitter: peripherals.transmitter,
                encoder: Encoder::default(),
                watchdog: peripherals.watchdog,
                store,
                logged: Logged::default(),
            },
        )
    }

    /// Flies with what was found in memory, if it is accepted, and logs it.
    fn parameters_in_force(flown: &mut Flown, found: &Found) -> ParametersInForce {
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
        while let Some(byte) = Active::receive(cx.local.receiver) {
            let _ = cx.local.received_in.enqueue(byte);
            if byte == 0 {
                rtic::pend(Interrupt::SPI1);
            }
        }
    }

    /// Supervision, law, rotors; then releases what is due.
    #[task(binds = SysTick, priority = 4, shared = [rate_loop, inbox, outbox],
           local = [flight, rotors])]
    fn control(cx: control::Context) {
        let control::SharedResources { mut rate_loop, mut inbox, mut outbox, .. } = cx.shared;
        let (flight, rotors) = (cx.local.flight, cx.local.rotors);
        let (due, overrun, uptime) = rate_loop.lock(|rate_loop| {
            let due = rate_loop.tick(now());
            let overrun = rate_loop.control_overran() || rate_loop.failsafe_required();
            (due, overrun, rate_loop.ticks())
        });
        UPTIME.store(uptime, Relaxed);
        let start = Active::cost();
        let (inputs, law) = inbox.lock(|inbox| inbox.take(overrun));
        if let Some(law) = law {
            flight.replace_law(law);
        }
        let outputs = flight.tick(&inputs);
        match outputs.thrusts.as_ref().and_then(|thrusts| thrusts.first_chunk()) {
            Some(thrusts) => rotors.command(thrusts),
            None => rotors.stop(),
        }
        let cost = Active::cost().wrapping_sub(start);
        outbox.lock(|outbox| {
            let flight_tick = outputs.flight_tick;
            outbox.progress = Progress { mode: outputs.mode, flight_tick, uptime };
            outbox.answer = outputs.answer.or(outbox.answer);
            if due.contains(Group::Telemetry) {
                outbox.telemetry = Some(flight.telemetry(&outputs, cost));
            }
        });
        Active::exercise(uptime);
        release(due);
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
    #[task(binds = SPI1, priority = 3, shared = [rate_loop, inbox, outbox, session, link],
           local = [received_out, decoder, telemetry_period])]
    fn state_input(cx: state_input::Context) {
        let state_input::SharedResources { mut rate_loop, mut inbox, mut outbox, .. } = cx.shared;
        let (mut session, mut link) = (cx.shared.session, cx.shared.link);
        let state_input::LocalResources { received_out, decoder, telemetry_period, .. } = cx.local;
        let (progress, answer) = outbox.lock(|outbox| (outbox.progress, outbox.answer.take()));
        session.lock(|session| {
            if let Some(answer) = answer {
                session.answered(answer);
            }
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
            if *telemetry_period != session.telemetry_period() {
                *telemetry_period = session.telemetry_period();
                let (period, deadline) = rates::telemetry_timing(*telemetry_period);
                // Every timing of `rates` is accepted (tested there).
                let _ = rate_loop.lock(|r| r.set_period(Group::Telemetry, period, deadline));
            }
        });
        link.lock(|link| *link = decoder.statistics());
        rate_loop.lock(|rate_loop| rate_loop.finish(Group::StateInput, now()));
    }

    /// Sends what the control group did, answers, and the health report.
    #[task(binds = SPI2, priority = 2, shared = [rate_loop, outbox, session, health],
           local = [transmitter, encoder])]
    fn telemetry(cx: telemetry::Context) {
        let telemetry::SharedResources {
            mut rate_loop, mut outbox, mut session, mut health, ..
        } = cx.shared;
        let (transmitter, encoder) = (cx.local.transmitter, cx.local.encoder);
        let telemetry = outbox.lock(|outbox| outbox.telemetry.take());
        let (subscribed, greeted) =
            session.lock(|session| (session.telemetry_period() != 0, session.greeted()));
        if let (Some(telemetry), true) = (telemetry, subscribed) {
            send(transmitter, encoder, &Downlink::Telemetry(telemetry));
        }
        for _ in 0..ANSWERS_A_RELEASE {
            let Some(answer) = session.lock(|session| session.next_answer()) else { break };
            send(transmitter, encoder, &answer);
        }
        if let (Some(health), true) = (health.lock(Option::take), greeted) {
            send(transmitter, encoder, &Downlink::Health(health));
        }
        Active::exchange();
        rate_loop.lock(|rate_loop| rate_loop.finish(Group::Telemetry, now()));
    }

    /// Sends one message.
    fn send(transmitter: &mut Tx<USART2>, encoder: &mut Encoder<Downlink>, message: &Downlink) {
        let mut frame = [0; MAX_FRAME];
        // Every message of the core fits a frame (tested there).
        let Ok(frame) = encoder.encode(message, &mut frame) else { return };
        Active::transmit(transmitter, frame);
    }

    /// Log, health report, stored parameters, watchdog.
    #[task(binds = SPI3, priority = 1, shared = [rate_loop, outbox, session, link, health],
           local = [watchdog, store, logged])]
    fn housekeeping(cx: housekeeping::Context) {
        let housekeeping::SharedResources { mut rate_loop, mut outbox, mut session, .. } =
            cx.shared;
        let (mut link, mut health_report) = (cx.shared.link, cx.shared.health);
        let link = link.lock(|link| *link);
        let dropped = session.lock(|session| session.dropped());
        let report = rate_loop.lock(|rate_loop| health(rate_loop, link, dropped));
        let progress = outbox.lock(|outbox| outbox.progress);
        log(cx.local.logged, progress, &report);
        health_report.lock(|health| *health = Some(report));
        if let Some(parameters) = session.lock(|session| session.next_to_store()) {
            let result = cx.local.store.append(&parameters.encode());
            session.lock(|session| session.stored(result));
        }
        let feed = rate_loop.lock(|rate_loop| {
            rate_loop.finish(Group::Housekeeping, now());
            rate_loop.feed_watchdog()
        });
        if feed {
            cx.local.watchdog.feed();
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
