//! Inner loops compiled for the vector units of the processor.

use pulp::{Arch, NullaryFnOnce};

/// Computes an expression with the vector units that the processor has, to the same bits as without them.
///
/// Functions that it calls are compiled for these units only if they are inlined.
macro_rules! vectorised {
    ($work:expr) => {
        $crate::vectorised::run(
            #[inline(always)]
            || $work,
        )
    };
}
pub(crate) use vectorised;

/// Runs a closure that is always inlined.
///
/// `Arch::dispatch` alone calls a closure as `FnOnce`. The compiler then adds a function in between, which has no vector
/// instructions.
#[inline(always)]
pub(crate) fn run<R>(work: impl FnMut() -> R) -> R {
    Arch::new().dispatch(Work(work))
}

struct Work<F>(F);

impl<R, F: FnMut() -> R> NullaryFnOnce for Work<F> {
    type Output = R;

    #[inline(always)]
    fn call(mut self) -> R {
        (self.0)()
    }
}
