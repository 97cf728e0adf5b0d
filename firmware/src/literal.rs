//! Constructors under the names that `Debug` prints: with them `build.rs` writes configurations as Rust.

use ctrl_core::filter::NotchConfig;
use ctrl_core::list::List;

/// A vector.
#[allow(non_snake_case, reason = "the name that `Debug` prints")]
pub const fn Vec3(x: f32, y: f32, z: f32) -> glam::Vec3 {
    glam::Vec3::new(x, y, z)
}

/// A list of at least one element.
pub const fn list<T: Copy, const M: usize, const N: usize>(elements: [T; M]) -> List<T, N> {
    let first = elements[0];
    List::from_array(elements, first)
}

/// No notches: theirs is the only list that may be empty.
pub const fn none<const N: usize>() -> List<NotchConfig, N> {
    List::empty(NotchConfig { frequency: 0.0, quality: 0.0 })
}
