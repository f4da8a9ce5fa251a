//! Settings files. They are `key = value` lines of TOML, and the keys are the names of [`KNOBS`].

use super::Settings;
use super::knobs::{KNOBS, Knob, Value};
use crate::Error;
use toml::de::DeTable;

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
    /// A message, without the file's name. It names the line that is not TOML, or the line and the key that is unknown
    /// or whose value is out of range. After an error no setting has changed.
    pub fn read_toml(&mut self, text: &str) -> Result<(), String> {
        let table: toml::Table = text.parse().map_err(|e: toml::de::Error| {
            let line = line_at(text, e.span().map_or(0, |span| span.start));
            format!("line {line}: {}", Error::shown(&e.message().replace('\n', ", ")))
        })?;
        let mut read = self.clone();
        for (key, value) in &table {
            if key == "render" && value.is_table() {
                continue;
            }
            set(&mut read, key, value).map_err(|what| format!("line {}: {what}", line_of(text, key)))?;
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

/// Sets the setting of this name to a value of a settings file.
fn set(settings: &mut Settings, key: &str, value: &toml::Value) -> Result<(), String> {
    let Some(knob) = Knob::named(key) else {
        let names: Vec<_> = KNOBS.iter().map(|knob| knob.name).collect();
        return Err(format!("unknown setting '{}': the settings are {}", Error::shown(key), names.join(", ")));
    };
    let text = match value {
        toml::Value::String(text) => text.clone(),
        toml::Value::Table(_) | toml::Value::Array(_) => {
            return Err(format!("{key}: the value is of the type {}: write one number or word", value.type_str()));
        }
        other => other.to_string(),
    };
    knob.set(settings, &text).map_err(|e| e.to_string())
}

/// Returns the number of the line on which a key of the outermost table stands, from 1.
fn line_of(text: &str, key: &str) -> usize {
    let table = DeTable::parse(text).ok();
    let keys = table.iter().flat_map(|table| table.get_ref().keys());
    let start = keys.filter(|found| found.get_ref() == key).map(|found| found.span().start).min();
    line_at(text, start.unwrap_or(0))
}

/// Returns the number of the line at this position in bytes, from 1.
fn line_at(text: &str, position: usize) -> usize {
    1 + text.as_bytes().iter().take(position).filter(|&&byte| byte == b'\n').count()
}
