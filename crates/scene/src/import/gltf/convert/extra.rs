//! What an object carries besides what is modelled.

use super::Result;
use crate::import::gltf::parse::parse;
use crate::import::gltf::place::At;
use crate::import::gltf::schema::Extensions;
use crate::model::Extra;
use serde::Deserialize;
use serde_json::value::RawValue;
use serde_json::{Map, Value};
use std::borrow::Cow;

/// The extensions of one object, of which those that are modelled are taken out; the rest is kept.
#[derive(Default)]
pub struct Members<'a>(Vec<(Cow<'a, str>, &'a RawValue)>, Vec<(&'static str, Value)>);

impl<'a> Members<'a> {
    pub fn new(extensions: Option<Extensions<'a>>) -> Self {
        Self(extensions.unwrap_or_default().0, Vec::new())
    }

    pub fn has(&self, name: &str) -> bool {
        self.0.iter().any(|(n, _)| n == name)
    }

    /// What is left, unparsed.
    pub fn into_extensions(self) -> Extensions<'a> {
        Extensions(self.0)
    }

    /// Takes an extension out, typed. `at` is the object that has it.
    pub fn take<T: Deserialize<'a>>(&mut self, name: &'static str, at: &At<'_>) -> Result<Option<T>> {
        let Some(i) = self.0.iter().position(|(n, _)| n == name) else {
            return Ok(None);
        };
        let (_, raw) = self.0.remove(i);
        parse(raw.get(), &at.key("extensions").key(name)).map(Some)
    }

    /// Keeps the extensions and extras of an extension object that the model has no place for, under the name of that
    /// extension: export writes them and the modelled members into one object.
    pub fn keep_rest(
        &mut self,
        name: &'static str,
        extensions: Option<Extensions<'a>>,
        extras: Option<&'a RawValue>,
        at: &At<'_>,
    ) -> Result<()> {
        if extensions.is_none() && extras.is_none() {
            return Ok(());
        }
        let rest = Members::new(extensions).finish(extras, &at.key("extensions").key(name))?;
        let mut object = Map::new();
        if let Some(extensions) = rest.extensions {
            object.insert("extensions".to_owned(), Value::Object(*extensions));
        }
        if let Some(extras) = rest.extras {
            object.insert("extras".to_owned(), *extras);
        }
        self.1.push((name, Value::Object(object)));
        Ok(())
    }

    /// What is left.
    pub fn finish(self, extras: Option<&'a RawValue>, at: &At<'_>) -> Result<Extra> {
        let mut extra = Extra::default();
        if let Some(raw) = extras {
            extra.extras = Some(Box::new(parse(raw.get(), &at.key("extras"))?));
        }
        if self.0.is_empty() && self.1.is_empty() {
            return Ok(extra);
        }
        let mut map = Map::with_capacity(self.0.len() + self.1.len());
        for (name, raw) in self.0 {
            let value = parse(raw.get(), &at.key("extensions").key(&name))?;
            map.insert(name.into_owned(), value);
        }
        for (name, value) in self.1 {
            map.insert(name.to_owned(), value);
        }
        extra.extensions = Some(Box::new(map));
        Ok(extra)
    }
}
