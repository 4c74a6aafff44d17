//! Decoders of others' making that may panic where a file is damaged.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::Once;

use super::asset::Checked;

thread_local! {
    static GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Runs `decode`; a panic in it is a fault of the file like any other, and nothing is printed.
pub(super) fn guarded<T>(decode: impl FnOnce() -> Checked<T>) -> Checked<T> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let before = take_hook();
        set_hook(Box::new(move |panic| {
            if !GUARDED.get() {
                before(panic);
            }
        }));
    });
    GUARDED.set(true);
    // What it leaves half done is its own, and is dropped.
    let result = catch_unwind(AssertUnwindSafe(decode));
    GUARDED.set(false);
    result.unwrap_or_else(|_| Err("is damaged: its decoder broke off".into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_a_fault() {
        assert_eq!(guarded(|| Ok(1)), Ok(1));
        let list: [u8; 0] = [];
        let broken = guarded(|| Ok(list[std::hint::black_box(7)]));
        assert!(broken.is_err_and(|fault| fault.contains("broke off")));
    }
}
