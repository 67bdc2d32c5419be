//! The same code compiled for several instruction sets, chosen when the program runs.
//!
//! A path changes how many numbers are worked on at once, never what is done to them: only operations that IEEE 754 rounds
//! exactly are used (no fused multiplications), so that all paths give the same bits.

use std::sync::LazyLock;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Paths allowed.
static ALLOWED: AtomicUsize = AtomicUsize::new(usize::MAX);

/// From now on use no more than the first `count` of [`Path::all`]: to compare their speed and their bits.
pub fn hold_to(count: usize) {
    ALLOWED.store(count, Ordering::Relaxed);
}

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

    /// The fastest path of this machine, of those that [`hold_to`] allows.
    pub fn best() -> Self {
        static ALL: LazyLock<Vec<Path>> = LazyLock::new(Path::all);
        let allowed = ALL.len().min(ALLOWED.load(Ordering::Relaxed));
        ALL[..allowed].last().copied().unwrap_or(Self::Baseline)
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
