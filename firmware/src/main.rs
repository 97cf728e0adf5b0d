//! The image: connects the tasks to the library.
//!
//! | task | priority | released by |
//! |---|---|---|
//! | `receive`, `receive_mavlink` | 6 | each byte on the link, and on the port of the ground station |
//! | `control` | 5 | SysTick; in lock step `state_input`, when the host requests a tick |
//! | `state_input` | 4 | `control` at each tick, `receive` at the end of a frame |
//! | `telemetry`, `housekeeping` | 3, 2 | `control`, when due |
//! | `mavlink` | 1 | `state_input`, at every fourth tick |
//!
//! In lock step `housekeeping` announces to the host that all work is done, but for that of `mavlink`, which no
//! other task waits for: it has no deadline, and whatever it does delays nothing above it but by the locks of
//! session and pilot, one message long.
//!
//! The lower groups are bound to interrupts that a flight controller on an F405 leaves free, and
//! pended by software: DCMI and CRYP belong to units that this chip does not have, HASH_RNG to its
//! random number generator alone, FSMC to memory that its package with 64 pins has no pins for. No executor and no
//! waker: every call is direct, so that the stack can be bounded statically. `receive` is above control because a
//! byte must be taken within 5 us; it moves one byte.
#![no_std]
#![no_main]

#[cfg(not(feature = "emulator"))]
use defmt_rtt as _;
#[cfg(feature = "emulator")]
use defmt_semihosting as _;

#[rtic::app(device = stm32f4xx_hal::pac, peripherals = true)]
mod app {
    use core::mem::MaybeUninit;
    use core::sync::atomic::Ordering::Relaxed;

    use cortex_m::peripheral::SCB;
    use ctrl_core::controller::AnyController;
    use ctrl_core::mode::safety::{SafetyConfig, SafetyReport};
    use firmware::board::peripherals::{
        Peripherals, Rotors, WATCHDOG_TIMEOUT, now, start_control_tick,
    };
    use firmware::board::transmitter::{MavlinkTransmitter, Transmitter};
    use firmware::board::{Active, Board, ROTORS};
    use firmware::event_log::EventLog;
    use firmware::exchange::{ControlStatus, Inbox, Outbox};
    use firmware::fault::{UPTIME, fault_before_boot};
    use firmware::flight_control::FlightControl;
    use firmware::ground_station::{
        BYTES_PER_RELEASE, Behind, GroundStation, RELEASE_EVERY, SENT_PER_RELEASE,
    };
    use firmware::navigation::OnboardNavigation;
    use firmware::parameter_store::{Found, ParameterStore};
    use firmware::pilot::Pilot;
    use firmware::rate_loop::{Due, Group};
    use firmware::scenario::{BUILT_IN_MISSION, Tuning};
    use firmware::session::{HostSession, SessionConfig, SessionMemory};
    use firmware::stored_parameters::{SetError, put_in_force};
    use firmware::stored_signing::StartedSigning;
    use firmware::tick_source::{Begin, Pend, TickOrigin, TickSource};
    use firmware::vehicle::VEHICLE;
    use firmware::{rates, scenario};
    use heapless::spsc::{Consumer, Producer, Queue};
    use link::{Decoder, Downlink, Health, LinkStatistics, ParametersInForce, Uplink};
    use mavlink_vehicle::ProtocolMemory;
    use rtic::Mutex;
    use stm32f4xx_hal::pac::{Interrupt, USART2, USART3};
    use stm32f4xx_hal::prelude::*;
    use stm32f4xx_hal::serial::Rx;
    use stm32f4xx_hal::watchdog::IndependentWatchdog;

    /// Bytes that may wait for `state_input`: two ticks of the link at full rate.
    const RECEIVED: usize = 512;
    /// Bytes that may wait for `mavlink`: those of 11 ms.
    const RECEIVED_MAVLINK: usize = 1024;
    /// Frames that `state_input` judges per release, samples and references and at most one other message;
    /// more wait in the queue: as many as a tick of flight by sensors has, a start, a sample of each sensor and a reference.
    /// A host that sends faster loses frames; a full queue at once may cost this task its deadline, never control its own.
    const FRAMES_PER_RELEASE: usize = 12;
    /// Most answers per release of `telemetry`.
    const ANSWERS_PER_RELEASE: usize = 2;

    /// What control shares with the tasks below it. One lock for all of it: each costs two writes of BASEPRI.
    pub struct Exchange {
        ticks: TickSource,
        inbox: &'static mut Inbox,
        outbox: Outbox,
    }

    /// What state input shares with the tasks below it.
    pub struct Host {
        session: &'static mut HostSession<'static>,
        pilot: &'static mut Pilot,
        link: LinkStatistics,
    }

    /// What telemetry shares with housekeeping.
    pub struct Line {
        health: Option<Health>,
        transmitter: Transmitter,
    }

    #[shared]
    struct Shared {
        exchange: Exchange,
        host: Host,
        line: Line,
    }

    #[local]
    struct Local {
        flight: &'static mut FlightControl,
        rotors: Rotors,
        receiver: Rx<USART2>,
        received_in: Producer<'static, u8>,
        received_out: Consumer<'static, u8>,
        decoder: Decoder<Uplink>,
        navigation: &'static mut OnboardNavigation,
        station: &'static mut GroundStation,
        mavlink_receiver: Rx<USART3>,
        mavlink_in: Producer<'static, u8>,
        mavlink_out: Consumer<'static, u8>,
        mavlink_transmitter: MavlinkTransmitter,
        watchdog: IndependentWatchdog,
        store: ParameterStore<<Active as Board>::Storage>,
        events: EventLog,
    }

    /// What takes hundreds of bytes is a static, zero at first, and filled in place.
    #[init(local = [queue: Queue<u8, RECEIVED> = Queue::new(),
                    mavlink_queue: Queue<u8, RECEIVED_MAVLINK> = Queue::new(),
                    pilot_memory: MaybeUninit<Pilot> = MaybeUninit::uninit(),
                    station_memory: MaybeUninit<GroundStation> = MaybeUninit::uninit(),
                    protocol_memory: ProtocolMemory = ProtocolMemory::new(),
                    memory: SessionMemory = SessionMemory::new(),
                    session_memory: MaybeUninit<HostSession<'static>> = MaybeUninit::uninit(),
                    inbox_memory: MaybeUninit<Inbox> = MaybeUninit::uninit(),
                    flight_memory: MaybeUninit<FlightControl> = MaybeUninit::uninit(),
                    navigation_memory: OnboardNavigation = OnboardNavigation::new()])]
    fn init(mut cx: init::Context) -> (Shared, Local) {
        let mut thrust_max = [0.0; ROTORS];
        for (max, rotor) in thrust_max.iter_mut().zip(&VEHICLE.geometry.rotors) {
            *max = rotor.thrust.upper;
        }
        let mut peripherals = Peripherals::new(cx.device, &mut cx.core, thrust_max);
        let fault = fault_before_boot(peripherals.watchdog_reset);
        if let Some(report) = &fault {
            firmware::fault::log(report);
            Active::report(report);
        }
        // May erase, which takes most of a second: the control loop has not begun.
        let (mut store, mut found) = ParameterStore::open(peripherals.storage);
        let signing = StartedSigning::begin(&mut store, &mut found);
        let mut tuning = BUILT_IN_MISSION.tuning;
        let in_force = parameters_in_force(&mut tuning, &found);
        let config = SessionConfig::new(Active::NAME, Active::TELEMETRY_PERIOD_MIN, &VEHICLE);
        let (place, memory) = (cx.local.session_memory, cx.local.memory);
        let trajectory = &BUILT_IN_MISSION.trajectory;
        let session =
            HostSession::new_in(place, memory, config, &tuning, trajectory, in_force, fault);
        // build.rs has checked all numbers: an error means a damaged image.
        let Ok(session) = session else { panic!("damaged scenario") };
        let flight = begin_flight(cx.local.flight_memory, session.law());
        let prepared = session.prepare(ControlStatus::default());
        let inbox = cx.local.inbox_memory.write(Inbox::new(prepared, session.law()));
        let Ok(pilot) = Pilot::moderate_in(cx.local.pilot_memory, session.law()) else {
            panic!("damaged scenario")
        };
        let (place, memory) = (cx.local.station_memory, cx.local.protocol_memory);
        let station = GroundStation::new_in(place, memory, signing.as_ref());
        let (received_in, received_out) = cx.local.queue.split();
        let (mavlink_in, mavlink_out) = cx.local.mavlink_queue.split();
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
                exchange: Exchange {
                    ticks: rates::tick_source(Active::lock_step_timeout()),
                    inbox,
                    outbox: Outbox::default(),
                },
                host: Host { session, pilot, link: LinkStatistics::default() },
                line: Line { health: None, transmitter: Transmitter::new(peripherals.transmitter) },
            },
            Local {
                flight,
                rotors: peripherals.rotors,
                receiver: peripherals.receiver,
                received_in,
                received_out,
                decoder: Decoder::default(),
                navigation: cx.local.navigation_memory,
                station,
                mavlink_receiver: peripherals.mavlink_receiver,
                mavlink_in,
                mavlink_out,
                mavlink_transmitter: MavlinkTransmitter::new(peripherals.mavlink_transmitter),
                watchdog: peripherals.watchdog,
                store,
                events: EventLog::default(),
            },
        )
    }

    /// Puts the law under supervision.
    #[inline(never)]
    fn begin_flight(
        place: &'static mut MaybeUninit<FlightControl>,
        law: &AnyController,
    ) -> &'static mut FlightControl {
        match FlightControl::new(law, &VEHICLE.supervisor, &VEHICLE.geometry) {
            Ok(flight) => {
                let flight = place.write(flight);
                let filter = &VEHICLE.rate_filter;
                if !filter.is_empty() && flight.set_rate_filter(filter).is_err() {
                    panic!("damaged vehicle");
                }
                let safety = &VEHICLE.safety;
                if *safety != SafetyConfig::default() && flight.set_safety(safety).is_err() {
                    panic!("damaged vehicle");
                }
                flight
            }
            Err(_) => panic!("damaged vehicle"),
        }
    }

    /// Puts the stored parameters in force, if they are accepted, and logs the result.
    #[inline(never)]
    fn parameters_in_force(tuning: &mut Tuning, found: &Found) -> ParametersInForce {
        let (in_force, result) = put_in_force(tuning, &BUILT_IN_MISSION.trajectory, found);
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

    /// Takes one byte from the wire; a full queue drops it, and the frame's checksum shows that.
    #[task(binds = USART2, priority = 6, local = [receiver, received_in])]
    fn receive(cx: receive::Context) {
        let mut ended = false;
        Active::receive(cx.local.receiver, |byte| {
            let _ = cx.local.received_in.enqueue(byte);
            ended |= byte == 0;
        });
        if ended {
            pend_state_input();
        }
    }

    /// Takes one byte of a ground station from the wire; a full queue drops it.
    #[task(binds = USART3, priority = 6, local = [mavlink_receiver, mavlink_in])]
    fn receive_mavlink(cx: receive_mavlink::Context) {
        // One byte: another that has come meanwhile raises the interrupt again.
        if let Ok(byte) = cx.local.mavlink_receiver.read() {
            let _ = cx.local.mavlink_in.enqueue(byte);
        }
    }

    /// Supervision, law, rotors; then releases the groups that are due.
    #[task(binds = SysTick, priority = 5, shared = [exchange], local = [flight, rotors])]
    fn control(cx: control::Context) {
        let (mut exchange, control::LocalResources { flight, rotors, .. }) =
            (cx.shared.exchange, cx.local);
        // Whoever waits for this lock is below control.
        exchange.lock(|Exchange { ticks, inbox, outbox }| {
            let tick = match ticks.begin(now()) {
                Begin::Wait => return,
                Begin::FeedWatchdog => return pend_housekeeping(),
                Begin::Tick(tick) => tick,
            };
            if tick.lock_step_ended {
                flight.disarm();
                inbox.disarm();
            }
            UPTIME.store(tick.uptime, Relaxed);
            let start = Active::cost();
            let outputs_off = tick.origin == TickOrigin::LockStep;
            if let Some(law) = inbox.take_law() {
                flight.replace_law(law);
            }
            let inputs = inbox.take(tick.overrun, outputs_off);
            let outputs = flight.tick(&inputs);
            match outputs.thrusts.as_ref().and_then(|thrusts| thrusts.first_chunk()) {
                Some(thrusts) if !outputs_off => rotors.command(thrusts),
                _ => rotors.stop(),
            }
            let cost = Active::cost().wrapping_sub(start);
            let (mode, flight_tick) = (outputs.mode, outputs.flight_tick);
            outbox.status = ControlStatus { mode, flight_tick, uptime: tick.uptime };
            outbox.answer = outputs.answer.or(outbox.answer);
            outbox.put_safety(&outputs.safety);
            if tick.due.contains(Group::Telemetry) {
                outbox.telemetry = Some(flight.telemetry(&outputs, cost));
                let (ready, thrust) = (flight.readiness(), outputs.wrench.thrust);
                (outbox.view.ready, outbox.view.thrust) = (ready, thrust);
            }
            outbox.view.cause = outputs.cause;
            Active::exercise(tick.uptime);
            release(tick.due);
            if outputs_off {
                pend_housekeeping();
            }
            ticks.finish(Group::Control, now());
        });
    }

    /// Pends the lower groups that are due.
    fn release(due: Due) {
        if due.contains(Group::StateInput) {
            pend_state_input();
        }
        if due.contains(Group::Telemetry) {
            pend_telemetry();
        }
        if due.contains(Group::Housekeeping) {
            pend_housekeeping();
        }
    }

    fn pend_state_input() {
        rtic::pend(Interrupt::DCMI);
    }

    fn pend_telemetry() {
        rtic::pend(Interrupt::CRYP);
    }

    fn pend_housekeeping() {
        rtic::pend(Interrupt::HASH_RNG);
    }

    /// Decodes frames, handles their messages, estimates the state from sensors, and prepares the inputs of the next tick.
    #[task(binds = DCMI, priority = 4, shared = [exchange, host],
           local = [received_out, decoder, navigation, prepared: Option<u32> = None])]
    fn state_input(cx: state_input::Context) {
        let (mut exchange, mut host) = (cx.shared.exchange, cx.shared.host);
        let state_input::LocalResources { received_out, decoder, navigation, prepared, .. } =
            cx.local;
        let (status, answer, safety, origin, lock_step_ended) =
            exchange.lock(|Exchange { ticks, outbox, .. }| {
                let lock_step_ended = ticks.take_lock_step_ended();
                let (answer, safety) = (outbox.answer.take(), outbox.take_safety());
                (outbox.status, answer, safety, ticks.origin(), lock_step_ended)
            });
        // Once a tick, and again for what changes the inputs.
        let mut renews = answer.is_some() || lock_step_ended || *prepared != Some(status.uptime);
        let (request, answers) = host.lock(|Host { session, pilot, link }| {
            if let Some(answer) = answer {
                pilot.answered(answer);
                session.answered(answer);
            }
            if lock_step_ended {
                session.refuse_commands();
                pilot.drop_command();
            }
            session.set_piloted(pilot.has_command());
            let mut bytes = RECEIVED;
            // wcet: at most FRAMES_PER_RELEASE iterations
            for _ in 0..FRAMES_PER_RELEASE {
                if !next_frame(received_out, decoder, &mut bytes) {
                    break;
                }
                let frame = decoder.take_frame();
                let Some(received) = &frame else { continue };
                // A measurement waits for the inertial sample of its tick.
                renews |= !matches!(received.message, Uplink::Measured(_));
                if !session.receive(&received.message, status) {
                    session.handle(received, status, origin);
                    break;
                }
            }
            *link = decoder.statistics();
            if !renews {
                return (None, session.has_answers());
            }
            *prepared = Some(status.uptime);
            prepare(session, pilot, navigation, &mut exchange, status, &safety);
            (session.take_lock_step_request(), session.has_answers())
        });
        if status.uptime.is_multiple_of(RELEASE_EVERY) {
            rtic::pend(Interrupt::FSMC);
        }
        let pend = exchange.lock(|Exchange { ticks, .. }| {
            ticks.finish(Group::StateInput, now());
            request.map(|request| ticks.apply(request))
        });
        match pend {
            Some(Pend::Control) => SCB::set_pendst(),
            Some(Pend::Answers) => {
                pend_telemetry();
                pend_housekeeping();
            }
            // Without a tick that is requested no other task sends the answers.
            None if origin == TickOrigin::LockStep && answers => pend_telemetry(),
            None => {}
        }
        // No tick will come for what waits behind the last frame.
        if origin == TickOrigin::LockStep && received_out.ready() {
            pend_state_input();
        }
    }

    /// Prepares the inputs of the tick after `status`, by the estimate if the vehicle flies by its sensors.
    #[inline(never)]
    fn prepare(
        session: &mut HostSession<'static>,
        pilot: &mut Pilot,
        navigation: &mut OnboardNavigation,
        exchange: &mut impl Mutex<T = Exchange>,
        status: ControlStatus,
        safety: &SafetyReport,
    ) {
        navigation.serve(session, status);
        if let Some(law) = session.take_law() {
            // Without a bound that suits it, stations do not fly the vehicle: it says so itself.
            let _ = pilot.follow(law);
            exchange.lock(|Exchange { inbox, .. }| inbox.put_law(law));
        }
        let mut prepared = pilot.prepare(session, status, safety);
        navigation.shift(&mut prepared.reference);
        session.guide(pilot.navigator().mode(), &prepared.reference);
        let health = pilot.health(session, status);
        let storing = session.is_storing();
        let period = session.telemetry_period();
        exchange.lock(|Exchange { ticks, inbox, .. }| {
            inbox.put_health(false, health);
            inbox.put(prepared, || pilot.next_command(storing).or_else(|| session.next_command()));
            ticks.time_telemetry(period);
        });
    }

    /// Hands bytes to the decoder until a frame ends, at most as many as are left of `bytes`.
    #[inline(never)]
    fn next_frame(
        received: &mut Consumer<'static, u8>,
        decoder: &mut Decoder<Uplink>,
        bytes: &mut usize,
    ) -> bool {
        // wcet: at most RECEIVED iterations in all
        while let (Some(left), Some(byte)) = (bytes.checked_sub(1), received.dequeue()) {
            *bytes = left;
            if decoder.push_byte(byte) {
                return true;
            }
        }
        false
    }

    /// Sends telemetry, answers and the health report.
    #[task(binds = CRYP, priority = 3, shared = [exchange, host, line])]
    fn telemetry(cx: telemetry::Context) {
        let (mut exchange, mut host) = (cx.shared.exchange, cx.shared.host);
        let mut line = cx.shared.line;
        let telemetry = exchange.lock(|Exchange { outbox, .. }| outbox.telemetry.take());
        let wire = line.lock(|Line { transmitter, health }| {
            let (subscribed, greeted) = host
                .lock(|Host { session, .. }| (session.telemetry_period() != 0, session.greeted()));
            let mut wire = 0;
            if let (Some(telemetry), true) = (telemetry, subscribed) {
                wire += transmitter.send(&Downlink::Telemetry(telemetry));
            }
            // wcet: at most ANSWERS_PER_RELEASE iterations
            for _ in 0..ANSWERS_PER_RELEASE {
                let answer = host.lock(|Host { session, .. }| session.next_answer());
                let Some(answer) = answer else { break };
                wire += transmitter.send(&answer);
            }
            if let (Some(health), true) = (health.take(), greeted) {
                wire += transmitter.send(&Downlink::Health(health));
            }
            wire
        });
        let origin = exchange.lock(|Exchange { ticks, .. }| {
            ticks.finish_telemetry(now(), wire);
            ticks.origin()
        });
        if origin == TickOrigin::Timer {
            Active::exchange();
        }
    }

    /// Log, health report, stored parameters, watchdog; in lock step, announces to the host that all
    /// work of its request is done.
    #[task(binds = HASH_RNG, priority = 2, shared = [exchange, host, line],
           local = [watchdog, store, events])]
    fn housekeeping(cx: housekeeping::Context) {
        let (mut exchange, mut host) = (cx.shared.exchange, cx.shared.host);
        let mut line = cx.shared.line;
        let (due, status, origin, mut announcement) =
            exchange.lock(|Exchange { ticks, outbox, .. }| {
                let due = ticks.is_due(Group::Housekeeping);
                let announcement = if due { None } else { ticks.take_announcement() };
                (due, outbox.status, ticks.origin(), announcement)
            });
        // Pended without a release while lock step waits for its host.
        let mut feed = !due && origin == TickOrigin::LockStep;
        if due {
            let (link, dropped, late) =
                host.lock(|Host { session, link, .. }| (*link, session.dropped(), session.late()));
            let report = exchange.lock(|Exchange { ticks, .. }| ticks.health(link, dropped));
            cx.local.events.log(status, &report, late);
            line.lock(|Line { health, .. }| *health = Some(report));
            store_next(&mut host, cx.local.store);
            (feed, announcement) = exchange.lock(|Exchange { ticks, .. }| {
                (ticks.finish_housekeeping(now()), ticks.take_announcement())
            });
        }
        if feed {
            cx.local.watchdog.feed();
        }
        if let Some(uptime_ticks) = announcement {
            line.lock(|Line { transmitter, .. }| announce(transmitter, uptime_ticks));
            Active::exchange();
        }
    }

    /// Stores what the session has to keep.
    #[inline(never)]
    fn store_next(
        host: &mut impl Mutex<T = Host>,
        store: &mut ParameterStore<<Active as Board>::Storage>,
    ) {
        if let Some(change) = host.lock(|Host { session, .. }| session.next_to_store()) {
            let result = change.store(store);
            host.lock(|Host { session, .. }| session.stored(result));
        }
    }

    /// Tells the host, in lock step, that a tick is done.
    #[inline(never)]
    fn announce(transmitter: &mut Transmitter, uptime_ticks: u64) {
        transmitter.send(&Downlink::Stepped { uptime_ticks });
    }

    /// Speaks MAVLink with a ground station: messages that have come, then what is due to be sent.
    #[task(binds = FSMC, priority = 1, shared = [exchange, host],
           local = [station, mavlink_out, mavlink_transmitter])]
    fn mavlink(cx: mavlink::Context) {
        let (mut exchange, mut host) = (cx.shared.exchange, cx.shared.host);
        let mavlink::LocalResources { station, mavlink_out, mavlink_transmitter, .. } = cx.local;
        let (status, view) = exchange.lock(|Exchange { outbox, .. }| (outbox.status, outbox.view));
        let change = host.lock(|Host { session, .. }| session.take_signing());
        if let Some(later) = station.keep_time(change, status) {
            host.lock(|Host { session, .. }| session.keep_signing_time(later, status));
        }
        // wcet: at most 384 iterations
        for taken in 0..BYTES_PER_RELEASE {
            let packet = match mavlink_out.dequeue() {
                Some(byte) => station.push(byte),
                None if taken == 0 => station.silence(),
                None => break,
            };
            if let Some(packet) = packet
                && station.check(&packet, status)
            {
                host.lock(|Host { session, pilot, .. }| {
                    station.handle(&packet, Behind { session, pilot, status, view });
                });
            }
            if mavlink_out.is_empty() {
                break;
            }
        }
        // wcet: at most 4 iterations
        for _ in 0..SENT_PER_RELEASE {
            let frame = host.lock(|Host { session, pilot, .. }| {
                station.next_frame(Behind { session, pilot, status, view })
            });
            let Some(mut frame) = frame else { break };
            station.sign(&mut frame);
            mavlink_transmitter.send(frame.as_bytes());
        }
    }
}
