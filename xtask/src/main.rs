//! `cargo xtask`: the project's checks and measurements, from any folder of the repository.

mod call_graph;
mod disassembly;
mod elf;
mod machine_code;
mod profile;
mod shell;
mod step_image;
mod toolchain;

use std::path::Path;

use anyhow::{Context, Result, bail};

fn main() -> Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().context("workspace root")?;
    std::env::set_current_dir(root)?;
    let arguments: Vec<_> = std::env::args().skip(1).collect();
    let words: Vec<_> = arguments.iter().map(String::as_str).collect();
    match words[..] {
        ["setup"] => toolchain::set_up(),
        ["machine-code"] => machine_code::check_all(),
        ["fly", controller, folder] => {
            step_image::build()?;
            let image = step_image::StepImage::open(controller)?;
            let flight = image.fly(Path::new(folder))?;
            println!("{:?} {:?}", flight.instructions, flight.closing);
            println!("{:?}", flight.answers);
            profile::print(&image, &flight, 30)
        }
        _ => bail!("usage: cargo xtask ..."),
    }
}
