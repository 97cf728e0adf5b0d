//! `fly`.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use clap::Args;
use mavlink_vehicle::coordinates::Origin;
use mavlink_vehicle::{Autopilot, ProtocolConfig};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use sil_host::fly::{
    FlyError, FlyEvent, FlyOptions, ImageOptions, ImageReport, PortOptions, fly as fly_session,
    fly_image, read_key,
};
use sil_host::log::LogOptions;
use sil_host::log::format::Format;
use sil_host::pil::emulator::{Emulator, QEMU, SHIFT};
use sil_host::report::{self, FlightReport};
use sim::scenario::LoadedScenario;

use super::LogArguments;
use super::run::TRACE_EVERY;

/// Arguments of `fly`.
#[derive(Clone, Debug, Args)]
pub struct FlyArguments {
    /// Built-in scenario or TOML file: its vehicle, controller and disturbance.
    #[arg(value_name = "NAME|FILE", default_value = "paper-saturated")]
    pub scenario: String,
    /// Change a value of the scenario, as in `--set controller.saturated.k4=3` (repeatable).
    #[arg(long = "set", value_name = "PATH=VALUE")]
    pub changes: Vec<String>,
    /// Times real time.
    #[arg(long, default_value_t = 1.0, value_name = "N", value_parser = speed)]
    pub speed: f64,
    /// Ground station that datagrams are sent to (repeatable).
    #[arg(long, default_value = "127.0.0.1:14550", value_name = "ADDRESS:PORT")]
    pub udp: Vec<SocketAddr>,
    /// Address at which ground stations may connect.
    #[arg(
        long,
        default_value = "127.0.0.1:5760",
        value_name = "ADDRESS:PORT",
        overrides_with = "tcp"
    )]
    pub tcp: SocketAddr,
    /// Fly the firmware's image in the emulator, with this program's plant, by MAVLink over its own port.
    #[arg(long, value_name = "ELF", conflicts_with_all = ["system", "px4", "origin"])]
    pub image: Option<PathBuf>,
    /// With an image: file that stands for the chip's memory of parameters and signing key.
    #[arg(long, value_name = "FILE", requires = "image")]
    pub memory: Option<PathBuf>,
    /// Number of the system in MAVLink.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=250))]
    pub system: u8,
    /// Claim to be PX4, for a station that knows no other autopilot with these modes.
    #[arg(long)]
    pub px4: bool,
    /// File whose first word is a key of 64 hexadecimal digits: what is sent is signed, what comes must be.
    #[arg(long, value_name = "FILE")]
    pub signing_key: Option<PathBuf>,
    /// Place of the world's origin: latitude and longitude (deg), altitude above sea level (m).
    #[arg(long, value_name = "LAT,LON,ALT", value_parser = origin, allow_hyphen_values = true)]
    pub origin: Option<Origin>,
    /// Land and stop after this time [s].
    #[arg(long, value_name = "S")]
    pub duration: Option<f64>,
    /// Output directory; each flight gets a directory below it.
    #[arg(long, default_value = "out", value_name = "DIR")]
    pub out: PathBuf,
    /// Control ticks per row of the trace.
    #[arg(long, default_value_t = TRACE_EVERY, value_name = "N")]
    pub trace_every: std::num::NonZeroU32,
    /// Logs for other programs; a ULog is written in any case.
    #[command(flatten)]
    pub log: LogArguments,
}

impl FlyArguments {
    fn ports(&self) -> PortOptions {
        PortOptions { udp: self.udp.clone(), tcp: Some(self.tcp) }
    }

    fn log(&self) -> LogOptions {
        let mut log = self.log.options();
        log.formats.push(Format::Ulog); // a second one of the same name is none
        log
    }

    fn options(&self) -> Result<FlyOptions, FlyError> {
        let plain = ProtocolConfig::default();
        Ok(FlyOptions {
            ports: self.ports(),
            protocol: ProtocolConfig {
                system: self.system,
                autopilot: if self.px4 { Autopilot::Px4 } else { Autopilot::Generic },
                origin: self.origin.unwrap_or(plain.origin),
                signing_key: self.signing_key.as_deref().map(read_key).transpose()?,
                ..plain
            },
            speed: self.speed,
            duration: self.duration,
            out: self.out.clone(),
            log: self.log(),
            trace_every: self.trace_every,
        })
    }
}

/// Flies until it is told to stop; `true` if every guarantee of every flight held.
///
/// # Errors
/// See [`FlyError`].
pub fn fly(arguments: &FlyArguments) -> Result<bool, FlyError> {
    let loaded = LoadedScenario::open(&arguments.scenario, &arguments.changes)?;
    let interrupts = count_interrupts().map_err(FlyError::Port)?;
    if let Some(image) = &arguments.image {
        return fly_the_image(arguments, &loaded, image, &interrupts);
    }
    let reports = fly_session(&loaded, &arguments.options()?, &interrupts, &mut |event| {
        show(arguments, &event);
    })?;
    Ok(reports.iter().all(FlightReport::passed))
}

fn show(arguments: &FlyArguments, event: &FlyEvent<'_>) {
    match event {
        FlyEvent::Listening(tcp) => print_connections(arguments, *tcp),
        FlyEvent::Flown(report) => print!("{}", report::table(report, false)),
        FlyEvent::Landing => println!("landing; again to stop at once"),
        FlyEvent::Late(ticks) => eprintln!("{ticks} ticks given up: the computer is too slow"),
    }
}

/// Flies the image; `true` if every guarantee of every flight held and no bit differed from the law on the host.
fn fly_the_image(
    arguments: &FlyArguments,
    loaded: &LoadedScenario,
    image: &Path,
    interrupts: &AtomicUsize,
) -> Result<bool, FlyError> {
    if let (Some(key), None) = (&arguments.signing_key, &arguments.memory) {
        let reason = "the image keeps a key in its memory: give it one by --memory FILE";
        return Err(FlyError::Key(key.clone(), reason.to_owned()));
    }
    let options = ImageOptions {
        emulator: Emulator {
            program: QEMU.into(),
            image: image.to_owned(),
            shift: SHIFT,
            counted: true,
        },
        ports: arguments.ports(),
        memory: arguments.memory.clone(),
        signing_key: arguments.signing_key.as_deref().map(read_key).transpose()?,
        speed: arguments.speed,
        duration: arguments.duration,
        out: arguments.out.clone(),
        log: arguments.log(),
        trace_every: arguments.trace_every,
    };
    let report = fly_image(loaded, &options, interrupts, &mut |event| show(arguments, &event))?;
    let passed = report.passed();
    let ImageReport { flights, ticks, compared, difference, height_max, late, skipped } = report;
    println!(
        "{} flights in {ticks} ticks, up to {height_max:.2} m; {late:.1} s behind the clock",
        flights.len()
    );
    match difference {
        Some(difference) => println!("the image differs from the law on the host: {difference}"),
        None => println!("{compared} ticks of flight with the bits of the law on the host"),
    }
    if skipped > 0 {
        println!("{skipped} ticks without telemetry: the image was too busy to send it");
    }
    Ok(passed)
}

fn print_connections(arguments: &FlyArguments, tcp: Option<SocketAddr>) {
    let who = if arguments.image.is_some() { " of the image" } else { "" };
    println!("MAVLink{who}, system {}, {} times real time", arguments.system, arguments.speed);
    for address in &arguments.udp {
        println!("  UDP to {address}: QGroundControl finds it; MAVSDK udpin://{address}");
    }
    if let Some(address) = tcp {
        println!("  TCP at {address}: MAVSDK tcpout://{address}, MAVProxy --master=tcp:{address}");
    }
    if arguments.signing_key.is_some() {
        println!("  signed: stations need the same key");
    }
    let lands = if arguments.image.is_some() { "stops at once" } else { "lands and stops" };
    println!("  Ctrl-C {lands}");
}

/// Counts Ctrl-C and requests to end.
fn count_interrupts() -> std::io::Result<Arc<AtomicUsize>> {
    let count = Arc::new(AtomicUsize::new(0));
    let counted = Arc::clone(&count);
    let mut signals = Signals::new([SIGINT, SIGTERM])?;
    std::thread::spawn(move || {
        for _ in signals.forever() {
            counted.fetch_add(1, Ordering::Relaxed);
        }
    });
    Ok(count)
}

fn speed(text: &str) -> Result<f64, String> {
    let speed: f64 = text.parse().map_err(|_| "expected a number, such as 4".to_owned())?;
    if (0.01..=100.0).contains(&speed) { Ok(speed) } else { Err("from 0.01 to 100".into()) }
}

fn origin(text: &str) -> Result<Origin, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    match numbers.as_deref() {
        Ok([latitude, longitude, altitude])
            if latitude.abs() <= 85.0 && longitude.abs() <= 180.0 && altitude.abs() <= 9000.0 =>
        {
            Ok(Origin {
                latitude: (latitude * 1e7).round() as i32,
                longitude: (longitude * 1e7).round() as i32,
                altitude: *altitude as f32,
            })
        }
        _ => {
            Err("expected latitude (within 85 deg), longitude and altitude, as in 47.4,8.5,0"
                .into())
        }
    }
}
