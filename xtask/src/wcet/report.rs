//! Bounds of the controllers' steps: printed, judged against measured counts, and mutants.

use anyhow::{Context, Result, ensure};

use super::analysis::Analysis;
use super::bound::Bounds;
use super::limit::Limits;
use super::timing::{ASSUMPTIONS, Model};
use crate::cycles::CLOCK;
use crate::disassembly::disassemble;
use crate::elf::Image;
use crate::step_image::{self, CONTROLLERS, STEP, StepImage};

/// How far a bound on instructions may lie above the largest measured count, as a factor.
const TIGHTNESS: f64 = 1.3;
/// The image of compiled mutants.
const MUTANTS: &str = "unbounded";
/// Mutants that must not get a bound, and the reason.
const UNBOUNDED: [(&str, &str); 4] = [
    ("mutant_loop", "loop"),
    ("mutant_scope", "loop"),
    ("mutant_recursion", "recursive"),
    ("mutant_pointer", "indirect"),
];
/// Instructions of the branch in `mutant_branch`, which no usual argument takes.
const ADDED: u64 = 500;

/// Builds the images, bounds every step and prints the bounds with their assumptions.
pub fn check() -> Result<()> {
    step_image::build()?;
    refuses_mutants()?;
    println!("assumptions:");
    ASSUMPTIONS.iter().for_each(|assumption| println!("  {assumption}"));
    for controller in CONTROLLERS {
        let image = StepImage::open(controller)?;
        let bounds = Bounds::of(STEP, &image.image, &image.listing).context(controller)?;
        print(controller, &image, &bounds);
    }
    crate::firmware::build()?;
    let bounds = super::tasks::bounds(&crate::firmware::image("board"))?;
    super::tasks::report(&bounds)?;
    println!("\nfirmware-emulator: counts in flights on the image");
    let tasks: Vec<_> = bounds.into_iter().map(|bound| bound.task).collect();
    super::measured::compare(&tasks)?;
    Ok(())
}

fn print(controller: &str, image: &StepImage, bounds: &Bounds) {
    println!("\n{controller}: at most, each function with what it calls");
    println!("{:>12} {:>12} {:>12}  function", "instructions", "cycles, hit", "cycles, miss");
    for (start, instructions) in bounds.functions(Model::Instructions) {
        let [hit, miss] = [Model::CyclesHit, Model::CyclesMiss].map(|model| {
            bounds.functions(model).find(|(other, _)| *other == start).map_or(0, |(_, cost)| cost)
        });
        let name = image.image.containing(start).map_or("?", |function| &function.name);
        println!("{instructions:>12} {hit:>12} {miss:>12}  {name}");
    }
    let [hit, miss] =
        [Model::CyclesHit, Model::CyclesMiss].map(|model| 1e6 * bounds.get(model) as f64 / CLOCK);
    println!("a step: at most {hit:.1} us (hit), {miss:.1} us (miss) at 168 MHz");
}

/// The check must be able to fail: compiled mutants get no bound, or one that shows what was added.
fn refuses_mutants() -> Result<()> {
    let path = step_image::path(MUTANTS);
    let (image, listing) = (Image::read(&path)?, disassemble(&path)?);
    let limits = Limits::open(&path, Vec::new())?;
    for (function, reason) in UNBOUNDED {
        // By the rules for a step, and by those for a task, which may have loops with a bound.
        let start = image.named(function)?.range.start;
        let task = Analysis::new(&image, &listing, &limits, &[]).cost(start).err();
        for error in [Bounds::of(function, &image, &listing).err(), task] {
            let error = error
                .with_context(|| format!("`{function}` of the image `{MUTANTS}` has a bound"))?;
            let found = format!("{error:#}");
            ensure!(
                found.contains(reason),
                "`{function}` is refused, but not as {reason}: {found}"
            );
            println!("mutant refused: {found}");
        }
    }
    // A task that claims no bound does not lend its functions to one that has to have one.
    let start = image.named("mutant_loop")?.range.start;
    let mut analysis = Analysis::new(&image, &listing, &limits, &[]);
    let problems = analysis.examine(start)?;
    ensure!(
        problems.len() == 1 && analysis.cost(start).is_err(),
        "`mutant_loop` has a bound once it has been examined without"
    );
    let bound = Bounds::of("mutant_branch", &image, &listing)?.get(Model::Instructions);
    let start = image.named("mutant_branch")?.range.start;
    let task = Analysis::new(&image, &listing, &limits, &[]).cost(start)?;
    ensure!(
        bound > ADDED && task.total(Model::Instructions) == bound,
        "a branch of {ADDED} instructions has a bound of {bound}"
    );
    println!("mutant with a branch of {ADDED} instructions: at most {bound}\n");
    Ok(())
}

/// Compares the bound with the largest measured count of a step, `max`.
pub fn judge(bound: u64, max: u64) -> Result<()> {
    ensure!(bound >= max, "a step took {max} instructions, more than the bound of {bound}");
    let factor = bound as f64 / max as f64;
    ensure!(
        factor <= TIGHTNESS,
        "the bound of {bound} instructions is {factor:.2} times the largest measured count, {max}; \
         at most {TIGHTNESS} is allowed: measure harder inputs or make the paths exclude each other"
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::judge;

    #[test]
    fn a_bound_lies_above_what_was_measured_and_not_far() {
        assert!(judge(1000, 1000).is_ok() && judge(1300, 1000).is_ok());
        assert!(judge(999, 1000).unwrap_err().to_string().contains("more than the bound"));
        assert!(judge(1301, 1000).unwrap_err().to_string().contains("at most 1.3"));
    }
}
