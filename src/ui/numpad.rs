//! Which digits come from the numeric pad: there they look along axes, while plain digits belong to the active tool.
//!
//! egui has one key for both (`Key::Num1` is documented as "from main row or numpad"; egui-winit drops winit's key
//! location and folds `Numpad1` and `Digit1` into one physical key). So the window's event loop runs through
//! [`Listener`], which notes where every digit key came from before eframe sees it. The notes and egui's events come in the same order; a frame
//! matches them by their physical key and takes out what is the pad's ([`Numpad::take`]). With NumLock off
//! the pad's keys are still its own: "End" on the 1 is no End key. A text field with the focus gets the digits as text.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use eframe::{EframeWinitApplication, UserEvent};
use egui::{Event, Key, Modifiers};
use winit::application::ApplicationHandler;
use winit::event::{DeviceEvent, DeviceId, StartCause, WindowEvent};
use winit::event_loop::ActiveEventLoop;
use winit::keyboard::{KeyCode, PhysicalKey};
use winit::window::WindowId;

/// One press or release of a digit key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Noted {
    digit: Key,
    pressed: bool,
    pad: bool,
}

/// The digit keys that the window system told of and that no frame has looked at yet.
#[derive(Clone, Debug, Default)]
pub struct Numpad {
    noted: Arc<Mutex<VecDeque<Noted>>>,
}

/// Notes that wait for a frame; more are only left over when egui kept an event back.
const MOST: usize = 256;

impl Numpad {
    /// Notes that a digit key went down or up, on the numeric pad or in the main row.
    pub fn note(&self, digit: Key, pressed: bool, pad: bool) {
        let mut noted = self.noted.lock().unwrap_or_else(PoisonError::into_inner);
        noted.push_back(Noted { digit, pressed, pad });
        if noted.len() > MOST {
            noted.pop_front();
        }
    }

    /// The digits that were pressed on the pad, with their modifiers; they are taken out of the frame's events, unless
    /// the user is typing text.
    pub fn take(&self, events: &mut Vec<Event>, typing: bool) -> Vec<(Modifiers, Key)> {
        let mut noted = self.noted.lock().unwrap_or_else(PoisonError::into_inner);
        let (mut out, mut dropped_key) = (Vec::new(), false);
        events.retain(|event| match event {
            Event::Key { physical_key: Some(digit), pressed, modifiers, .. } if is_digit(*digit) => {
                let at = noted.iter().position(|n| n.digit == *digit && n.pressed == *pressed);
                let pad = at.is_some_and(|at| {
                    let pad = noted[at].pad;
                    noted.drain(..=at);
                    pad
                });
                dropped_key = pad && !typing;
                if dropped_key && *pressed {
                    out.push((*modifiers, *digit));
                }
                !dropped_key
            }
            // The text that a key makes comes right behind it.
            Event::Text(_) if dropped_key => {
                dropped_key = false;
                false
            }
            _ => {
                dropped_key = false;
                true
            }
        });
        out
    }
}

fn is_digit(key: Key) -> bool {
    const DIGITS: [Key; 10] =
        [Key::Num0, Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5, Key::Num6, Key::Num7, Key::Num8, Key::Num9];
    DIGITS.contains(&key)
}

/// The digit of a physical key, and whether it is on the pad.
fn digit(code: KeyCode) -> Option<(Key, bool)> {
    Some(match code {
        KeyCode::Digit0 => (Key::Num0, false),
        KeyCode::Digit1 => (Key::Num1, false),
        KeyCode::Digit2 => (Key::Num2, false),
        KeyCode::Digit3 => (Key::Num3, false),
        KeyCode::Digit4 => (Key::Num4, false),
        KeyCode::Digit5 => (Key::Num5, false),
        KeyCode::Digit6 => (Key::Num6, false),
        KeyCode::Digit7 => (Key::Num7, false),
        KeyCode::Digit8 => (Key::Num8, false),
        KeyCode::Digit9 => (Key::Num9, false),
        KeyCode::Numpad0 => (Key::Num0, true),
        KeyCode::Numpad1 => (Key::Num1, true),
        KeyCode::Numpad2 => (Key::Num2, true),
        KeyCode::Numpad3 => (Key::Num3, true),
        KeyCode::Numpad4 => (Key::Num4, true),
        KeyCode::Numpad5 => (Key::Num5, true),
        KeyCode::Numpad6 => (Key::Num6, true),
        KeyCode::Numpad7 => (Key::Num7, true),
        KeyCode::Numpad8 => (Key::Num8, true),
        KeyCode::Numpad9 => (Key::Num9, true),
        _ => return None,
    })
}

/// The application in the window's event loop, with an ear at the keyboard.
pub struct Listener<'a> {
    /// What eframe made of the application.
    pub app: EframeWinitApplication<'a>,
    /// Where digits are noted.
    pub numpad: Numpad,
}

impl ApplicationHandler<UserEvent> for Listener<'_> {
    fn window_event(&mut self, event_loop: &ActiveEventLoop, id: WindowId, event: WindowEvent) {
        if let WindowEvent::KeyboardInput { event: key, .. } = &event
            && let PhysicalKey::Code(code) = key.physical_key
            && let Some((digit, pad)) = digit(code)
        {
            self.numpad.note(digit, key.state.is_pressed(), pad);
        }
        self.app.window_event(event_loop, id, event);
    }

    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        self.app.resumed(event_loop);
    }

    fn new_events(&mut self, event_loop: &ActiveEventLoop, cause: StartCause) {
        self.app.new_events(event_loop, cause);
    }

    fn user_event(&mut self, event_loop: &ActiveEventLoop, event: UserEvent) {
        self.app.user_event(event_loop, event);
    }

    fn device_event(&mut self, event_loop: &ActiveEventLoop, id: DeviceId, event: DeviceEvent) {
        self.app.device_event(event_loop, id, event);
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        self.app.about_to_wait(event_loop);
    }

    fn suspended(&mut self, event_loop: &ActiveEventLoop) {
        self.app.suspended(event_loop);
    }

    fn exiting(&mut self, event_loop: &ActiveEventLoop) {
        self.app.exiting(event_loop);
    }

    fn memory_warning(&mut self, event_loop: &ActiveEventLoop) {
        self.app.memory_warning(event_loop);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn event(key: Key, physical: Key, pressed: bool, modifiers: Modifiers) -> Event {
        Event::Key { key, physical_key: Some(physical), pressed, repeat: false, modifiers }
    }

    #[test]
    fn the_pads_digits_are_told_from_those_of_the_main_row() {
        let pad = Numpad::default();
        let mut events = Vec::new();
        for (digit, on_pad) in [(Key::Num1, false), (Key::Num1, true), (Key::Num3, true)] {
            for pressed in [true, false] {
                pad.note(digit, pressed, on_pad);
                events.push(event(digit, digit, pressed, Modifiers::CTRL));
                if pressed {
                    events.push(Event::Text("1".to_owned()));
                }
            }
        }
        let taken = pad.take(&mut events, false);
        assert_eq!(taken, [(Modifiers::CTRL, Key::Num1), (Modifiers::CTRL, Key::Num3)]);
        let left = [
            event(Key::Num1, Key::Num1, true, Modifiers::CTRL),
            Event::Text("1".to_owned()),
            event(Key::Num1, Key::Num1, false, Modifiers::CTRL),
        ];
        assert_eq!(events, left);
    }

    #[test]
    fn without_num_lock_the_pad_is_still_the_pad_and_typing_gets_everything() {
        let pad = Numpad::default();
        pad.note(Key::Num1, true, true);
        let mut events = vec![event(Key::End, Key::Num1, true, Modifiers::NONE)];
        assert_eq!(pad.take(&mut events, false), [(Modifiers::NONE, Key::Num1)]);
        assert!(events.is_empty());
        pad.note(Key::Num7, true, true);
        let mut events = vec![event(Key::Num7, Key::Num7, true, Modifiers::NONE), Event::Text("7".to_owned())];
        assert!(pad.take(&mut events, true).is_empty());
        assert_eq!(events.len(), 2);
    }

    #[test]
    fn an_event_that_egui_kept_back_does_not_shift_the_others() {
        let pad = Numpad::default();
        pad.note(Key::Num2, true, true);
        pad.note(Key::Num1, true, false);
        let mut events = vec![event(Key::Num1, Key::Num1, true, Modifiers::NONE)];
        assert!(pad.take(&mut events, false).is_empty());
        assert_eq!(events.len(), 1, "a digit of the main row stays");
    }
}
