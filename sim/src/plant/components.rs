//! The components of one vector or quaternion side by side in SIMD lanes.
//!
//! Every operation is one of IEEE 754 per component, so the bits are those of the same formula component by component.

use core::ops::{Add, Div, Mul};

use glam::{DQuat, DVec3};

use crate::lanes::{Scalars, all, four};

/// `[x, y, z, w]` of a quaternion; of a vector, whose `w` has no meaning.
#[derive(Clone, Copy, Debug)]
pub(super) struct Components(pub Scalars);

macro_rules! permutations {
    ($($name:ident $a:literal $b:literal $c:literal $d:literal;)*) => { $(
        #[inline(always)]
        pub fn $name(self) -> Self {
            let it = self.0.to_array();
            Self(Scalars::new([it[$a], it[$b], it[$c], it[$d]]))
        }
    )* };
}

/// Named after the components that they put in place of `x`, `y`, `z` and, for a quaternion, `w`.
impl Components {
    permutations! {
        yzx 1 2 0 3;
        zxy 2 0 1 3;
        xyzx 0 1 2 0;
        yzxy 1 2 0 1;
        zxyy 2 0 1 1;
        yzxz 1 2 0 2;
        zxyz 2 0 1 2;
        wwwx 3 3 3 0;
    }

    /// With `w` negated.
    #[inline(always)]
    pub fn w_negated(self) -> Self {
        Self(self.0 ^ Scalars::new([0.0, 0.0, 0.0, -0.0]))
    }

    /// With every component but `w` negated.
    #[inline(always)]
    pub fn but_w_negated(self) -> Self {
        Self(self.0 ^ Scalars::new([-0.0, -0.0, -0.0, 0.0]))
    }

    /// The quaternion of unit length.
    #[inline(always)]
    pub fn unit(self) -> Self {
        let [x, y, z, w] = (self.0 * self.0).to_array();
        self * (1.0 / (x + y + z + w).sqrt())
    }
}

impl Add for Components {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }
}

impl Mul for Components {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(self.0 * other.0)
    }
}

impl Mul<f64> for Components {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        Self(self.0 * all(factor))
    }
}

impl Div<f64> for Components {
    type Output = Self;
    #[inline(always)]
    fn div(self, divisor: f64) -> Self {
        Self(self.0 / all(divisor))
    }
}

impl From<DVec3> for Components {
    #[inline(always)]
    fn from(v: DVec3) -> Self {
        Self(four(v, v.z))
    }
}

impl From<DQuat> for Components {
    #[inline(always)]
    fn from(q: DQuat) -> Self {
        Self(Scalars::new(q.to_array()))
    }
}

impl From<Components> for DVec3 {
    #[inline(always)]
    fn from(components: Components) -> Self {
        let [x, y, z, _] = components.0.to_array();
        Self::new(x, y, z)
    }
}

impl From<Components> for DQuat {
    #[inline(always)]
    fn from(components: Components) -> Self {
        Self::from_array(components.0.to_array())
    }
}
