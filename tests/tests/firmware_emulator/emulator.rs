//! Builds the firmware's images and runs them in QEMU.

use std::env;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output};
use std::sync::OnceLock;
use std::thread;
use std::time::{Duration, Instant};

use sil_host::pil::emulator::{Emulator, NATURAL_SHIFT, QEMU};
use sil_host::pil::lockstep::PATIENCE;

/// Builds the images, once, and returns the directory they are in.
fn images() -> &'static Path {
    static IMAGES: OnceLock<PathBuf> = OnceLock::new();
    IMAGES.get_or_init(|| {
        let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().unwrap();
        let built = Command::new(env!("CARGO"))
            .args(["build", "--quiet", "--package", "firmware", "--release"])
            .args(["--target", "thumbv7em-none-eabihf", "--features", "emulator"])
            .args(["--target-dir".as_ref(), target.as_os_str()])
            .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap())
            .status()
            .expect("cargo");
        assert!(built.success(), "the images do not build");
        target.join("thumbv7em-none-eabihf/release")
    })
}

/// The emulator with one of the images.
pub fn emulator(image: &str) -> Emulator {
    let (program, image) = (QEMU.into(), images().join(image));
    Emulator { program, image, shift: NATURAL_SHIFT, counted: true }
}

/// Runs an image until it ends; the exit status is the image's.
pub fn run(image: &str, directives: &[String]) -> Output {
    finish(emulator(image).start(directives, "null").unwrap())
}

/// Waits for the end of a run, but not for ever.
pub fn finish(mut child: Child) -> Output {
    let end = Instant::now() + PATIENCE;
    while child.try_wait().unwrap().is_none() {
        if Instant::now() > end {
            child.kill().unwrap();
            let output = child.wait_with_output().unwrap();
            panic!("still running after {PATIENCE:?}: {}", text(&output.stderr));
        }
        thread::sleep(Duration::from_millis(5));
    }
    child.wait_with_output().unwrap()
}

/// All that is left of a stream.
pub fn read_all(mut stream: impl Read) -> String {
    let mut bytes = Vec::new();
    stream.read_to_end(&mut bytes).unwrap();
    text(&bytes)
}

/// Text of a stream.
pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}
