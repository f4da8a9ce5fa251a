//! Settings files. They are `key = value` lines of TOML, and the keys are the names of [`KNOBS`].

use super::Settings;
use super::knobs::{KNOBS, Knob, Value};
use crate::Error;

impl From<Value> for toml::Value {
    fn from(value: Value) -> toml::Value {
        match value {
            Value::Count(count) => i64::from(count).into(),
            Value::Number(number) => number.into(),
            Value::Switch(on) => on.into(),
            Value::Text(text) => text.into(),
        }
    }
}

impl Settings {
    /// Reads the text of a settings file: `key = value` lines of TOML, where the keys are the names of [`KNOBS`].
    /// Settings that the text does not name keep their values. A table `[render]` is skipped: in the metadata of an
    /// image it holds what else the image was made with, such as the camera.
    ///
    /// # Errors
    /// A message, without the file's name. It names the line that is not TOML, the key that is unknown, or the key
    /// whose value is out of range. After an error no setting has changed.
    pub fn read_toml(&mut self, text: &str) -> Result<(), String> {
        let table: toml::Table = text.parse().map_err(|e: toml::de::Error| {
            let before = e.span().map_or(&[][..], |span| &text.as_bytes()[..span.start.min(text.len())]);
            let line = 1 + before.iter().filter(|&&byte| byte == b'\n').count();
            format!("line {line}: {}", Error::shown(&e.message().replace('\n', ", ")))
        })?;
        let mut read = self.clone();
        for (key, value) in &table {
            if key == "render" && value.is_table() {
                continue;
            }
            let Some(knob) = Knob::named(key) else {
                let names: Vec<_> = KNOBS.iter().map(|knob| knob.name).collect();
                return Err(format!("unknown setting '{}': the settings are {}", Error::shown(key), names.join(", ")));
            };
            let text = match value {
                toml::Value::String(text) => text.clone(),
                toml::Value::Table(_) | toml::Value::Array(_) => {
                    return Err(format!(
                        "{key}: the value is of the type {}: write one number or word",
                        value.type_str()
                    ));
                }
                other => other.to_string(),
            };
            knob.set(&mut read, &text).map_err(|e| e.to_string())?;
        }
        *self = read;
        Ok(())
    }

    /// Returns the text of a settings file that holds every setting, one line each, in the order of [`KNOBS`]. A
    /// setting that has no value of its own, because it follows from other settings, is left out.
    #[must_use]
    pub fn to_toml(&self) -> String {
        let set = KNOBS.iter().filter(|knob| !knob.is_unset(self));
        let table: toml::Table = set.map(|knob| (knob.name.to_string(), (knob.get)(self).into())).collect();
        table.to_string()
    }
}
