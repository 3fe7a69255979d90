//! What was chosen before, to go back to and forth.

use std::collections::VecDeque;

/// Steps that are kept.
const STEPS: usize = 200;

/// The past and the undone future of a value that is changed elsewhere. What happens between two rests is one step.
#[derive(Debug, Clone)]
pub struct History<T> {
    past: VecDeque<T>,
    /// The value at the last rest.
    present: T,
    future: Vec<T>,
}

impl<T: Clone + PartialEq> History<T> {
    /// No past, no future.
    pub fn new(present: T) -> Self {
        History { past: VecDeque::new(), present, future: Vec::new() }
    }

    /// Takes note of the value at a rest: if it has changed, that is one step, and what was undone before is forgotten.
    pub fn note(&mut self, value: &T) {
        if *value == self.present {
            return;
        }
        self.past.push_back(std::mem::replace(&mut self.present, value.clone()));
        if self.past.len() > STEPS {
            self.past.pop_front();
        }
        self.future.clear();
    }

    /// A change that is no step to undo: if the present value is the one before it, it is the one after it.
    pub fn amend(&mut self, before: &T, after: &T) {
        if self.present == *before {
            self.present = after.clone();
        }
    }

    /// Whether there is something to undo, `value` being the present one, at rest or not.
    pub fn has_past(&self, value: &T) -> bool {
        !self.past.is_empty() || *value != self.present
    }

    /// Whether there is something to redo.
    pub fn has_future(&self, value: &T) -> bool {
        !self.future.is_empty() && *value == self.present
    }

    /// The value one step before.
    pub fn undo(&mut self, value: &T) -> Option<T> {
        self.note(value);
        let before = self.past.pop_back()?;
        self.future.push(std::mem::replace(&mut self.present, before.clone()));
        Some(before)
    }

    /// The value that was undone last.
    pub fn redo(&mut self, value: &T) -> Option<T> {
        self.note(value);
        let after = self.future.pop()?;
        self.past.push_back(std::mem::replace(&mut self.present, after.clone()));
        Some(after)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn undo_and_redo_go_through_the_rests() {
        let mut history = History::new(0);
        assert_eq!((history.undo(&0), history.redo(&0)), (None, None));
        history.note(&1);
        history.note(&1);
        history.note(&4);
        assert_eq!((history.undo(&4), history.undo(&1), history.undo(&0)), (Some(1), Some(0), None));
        assert_eq!((history.redo(&0), history.redo(&1), history.redo(&4)), (Some(1), Some(4), None));
    }

    #[test]
    fn what_is_not_at_rest_yet_is_a_step_too() {
        let mut history = History::new(0);
        assert!(!history.has_past(&0) && history.has_past(&2));
        assert_eq!(history.undo(&2), Some(0));
        assert!(history.has_future(&0) && !history.has_future(&1));
        assert_eq!(history.redo(&0), Some(2));
    }

    #[test]
    fn another_way_forgets_what_was_undone() {
        let mut history = History::new(0);
        history.note(&1);
        assert_eq!(history.undo(&1), Some(0));
        assert_eq!(history.redo(&7), None, "7 was chosen since");
        assert_eq!(history.undo(&7), Some(0));
    }

    #[test]
    fn what_is_no_step_is_not_undone() {
        let mut history = History::new(0);
        history.note(&1);
        history.amend(&1, &5);
        history.amend(&1, &6);
        assert_eq!((history.undo(&5), history.redo(&0)), (Some(0), Some(5)));
    }

    #[test]
    fn the_past_is_bounded() {
        let mut history = History::new(0);
        (1..=3 * STEPS).for_each(|i| history.note(&i));
        let mut value = 3 * STEPS;
        while let Some(before) = history.undo(&value) {
            value = before;
        }
        assert_eq!(value, 2 * STEPS);
    }
}
