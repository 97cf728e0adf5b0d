//! Builds the firmware's images and runs them in QEMU.

use std::env;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::OnceLock;
use std::thread;
use std::time::{Duration, Instant};

/// Longest that an emulated run, or one answer of it, may take.
pub const PATIENCE: Duration = Duration::from_secs(60);

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

/// Starts an image; `directives` are its command line.
pub fn start(image: &str, directives: &[String]) -> Child {
    start_with_serial(image, directives, "null")
}

/// Starts an image with USART2 on a character device of QEMU.
pub fn start_with_serial(image: &str, directives: &[String], serial: &str) -> Child {
    let mut semihosting = format!("enable=on,target=native,arg={image}");
    for directive in directives {
        semihosting += &format!(",arg={directive}");
    }
    Command::new("qemu-system-arm")
        .args(["-machine", "netduinoplus2", "-nodefaults", "-display", "none"])
        .args(["-monitor", "none", "-serial", "null", "-serial", serial])
        .args(["-icount", "shift=3,sleep=off"])
        .args(["-semihosting-config", &semihosting])
        .args(["-kernel".as_ref(), images().join(image).as_os_str()])
        .stdin(Stdio::null())
        .stdout(Stdio::null()) // the log is encoded; the tests read standard error
        .stderr(Stdio::piped())
        .spawn()
        .expect("qemu-system-arm must be installed")
}

/// Runs an image until it ends; the exit status is the image's.
pub fn run(image: &str, directives: &[String]) -> Output {
    finish(start(image, directives))
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

/// Text of a stream.
pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}
