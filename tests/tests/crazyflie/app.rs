//! The app as a program of the host, compiled against the stubs and driven over a pipe.

use std::cell::RefCell;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use ctrl_core::controller::{StepOutput, StepStatus, TrackingController};
use ctrl_core::reference::Reference;
use ctrl_core::vehicle::{VehicleState, Wrench};
use glam::Vec3;
use sim::closed_loop::ObservedController;

use crate::set_point::SetPoint;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Runs to the end; panics unless it succeeds.
fn run(command: &mut Command) {
    let status = command.current_dir(root()).status();
    assert!(status.as_ref().is_ok_and(|status| status.success()), "{command:?}: {status:?}");
}

/// The C library, installed once per test program.
fn library() -> &'static Path {
    static PREFIX: std::sync::OnceLock<PathBuf> = std::sync::OnceLock::new();
    PREFIX.get_or_init(|| {
        let prefix = Path::new(env!("CARGO_TARGET_TMPDIR")).join("gyrfalcon");
        let install = ["run", "--quiet", "--package", "xtask", "--", "c-library", "install"];
        run(Command::new(env!("CARGO")).args(install).arg(&prefix));
        prefix
    })
}

/// The running program.
pub struct App {
    program: Child,
    line: RefCell<(ChildStdin, ChildStdout)>,
}

impl App {
    /// Compiles the program as `name` with `options` of gcc, and starts it.
    pub fn start(name: &str, options: &[&str]) -> Self {
        let library = library();
        let folder = root().join("integrations/crazyflie");
        let program = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("crazyflie-{name}"));
        let sources = ["app/src/gyrfalcon_app.c", "test/firmware.c", "test/flight.c"];
        run(Command::new("gcc")
            .args([
                "-std=gnu11",
                "-Wall",
                "-Wextra",
                "-Werror",
                "-Wdouble-promotion",
                "-O2",
                "-g",
                "-pthread",
            ])
            .args(options)
            .arg("-I")
            .arg(library.join("include"))
            .arg("-I")
            .arg(folder.join("stubs"))
            .arg("-I")
            .arg(folder.join("app/src"))
            .args(sources.map(|source| folder.join(source)))
            .arg(library.join("lib/gyrfalcon.o"))
            .arg("-lm")
            .arg("-o")
            .arg(&program));
        let mut program = Command::new(program)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the app");
        let line = (program.stdin.take().expect("piped"), program.stdout.take().expect("piped"));
        Self { program, line: RefCell::new(line) }
    }
}

impl Drop for App {
    fn drop(&mut self) {
        // The last tick has been answered: the program is waiting for input.
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

impl TrackingController for App {
    type State = ();

    fn initial_state(&self) {}

    fn step(&self, (): &mut (), vehicle: &VehicleState, reference: &Reference) -> StepOutput {
        let (stdin, stdout) = &mut *self.line.borrow_mut();
        let words = SetPoint::new(vehicle, reference).words();
        let bytes: Vec<_> = words.into_iter().flat_map(f32::to_le_bytes).collect();
        stdin.write_all(&bytes).expect("the app reads");
        let mut answer = [0; 24];
        stdout.read_exact(&mut answer).expect("the app answers");
        let (words, _) = answer.as_chunks::<4>();
        let number = |index: usize| f32::from_le_bytes(words[index]);
        let count = |index: usize| u32::from_le_bytes(words[index]);
        assert_eq!(count(5), 0, "the app did not fly itself");
        let torque_body = Vec3::new(number(1), number(2), number(3));
        let status = StepStatus::from_bits(count(4) as u16).expect("known bits");
        StepOutput { status, ..StepOutput::from(Wrench { thrust: number(0), torque_body }) }
    }

    fn step_period(&self) -> f32 {
        1e-3
    }
}

impl ObservedController for App {}
