//! The same code compiled for several instruction sets, chosen when the program runs.
//!
//! A path changes how many numbers are worked on at once, never what is done to them: only operations that IEEE 754 rounds
//! exactly are used (no fused multiplications), so that all paths give the same bits.

use std::sync::LazyLock;

/// A set of instructions.
#[derive(Debug, Clone, Copy)]
pub enum Path {
    /// What every machine of this kind has: SSE2 on x86-64.
    Baseline,
    /// AVX2 and what comes with it.
    #[cfg(target_arch = "x86_64")]
    Avx2(pulp::x86::V3),
    /// AVX-512 and what comes with it.
    #[cfg(target_arch = "x86_64")]
    Avx512(pulp::x86::V4),
}

impl Path {
    /// The paths of this machine, the fastest last.
    pub fn all() -> Vec<Self> {
        let mut paths = vec![Self::Baseline];
        #[cfg(target_arch = "x86_64")]
        {
            paths.extend(pulp::x86::V3::try_new().map(Self::Avx2));
            paths.extend(pulp::x86::V4::try_new().map(Self::Avx512));
        }
        paths
    }

    /// The fastest path of this machine.
    pub fn best() -> Self {
        static BEST: LazyLock<Path> = LazyLock::new(|| Path::all().pop().unwrap_or(Path::Baseline));
        *BEST
    }

    /// Run `op`, compiled for this path as far as it is inlined.
    #[inline(always)]
    pub fn run<R>(self, op: impl FnOnce() -> R) -> R {
        match self {
            Self::Baseline => op(),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(simd) => pulp::Simd::vectorize(simd, op),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(simd) => pulp::Simd::vectorize(simd, op),
        }
    }
}
