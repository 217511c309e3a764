//! What an object carries besides what is modelled.

use super::Result;
use crate::import::gltf::parse::parse;
use crate::import::gltf::schema::{Extensions, Rest};
use crate::model::{Extra, Other};
use crate::place::At;
use serde::Deserialize;
use serde_json::value::RawValue;
use serde_json::{Map, Value};
use std::borrow::Cow;

/// The extensions of one object, of which those that are modelled are taken out; the rest is kept, and so are members that
/// nobody knows.
#[derive(Default)]
pub struct Members<'a> {
    extensions: Vec<(Cow<'a, str>, &'a RawValue)>,
    kept: Vec<(&'static str, Value)>,
    rest: Rest,
    /// Whether the file has an empty `extensions` object, which is kept as well.
    is_empty_object: bool,
}

impl<'a> Members<'a> {
    pub fn new(extensions: Option<Extensions<'a>>, rest: Rest) -> Self {
        let is_empty_object = extensions.as_ref().is_some_and(|extensions| extensions.0.is_empty());
        Self { extensions: extensions.unwrap_or_default().0, kept: Vec::new(), rest, is_empty_object }
    }

    pub fn has(&self, name: &str) -> bool {
        self.extensions.iter().any(|(n, _)| n == name)
    }

    /// What is left, unparsed.
    pub fn into_extensions(self) -> Option<Extensions<'a>> {
        (!self.extensions.is_empty() || self.is_empty_object).then_some(Extensions(self.extensions))
    }

    /// Takes an extension out, typed. `at` is the object that has it.
    pub fn take<T: Deserialize<'a>>(&mut self, name: &'static str, at: &At<'_>) -> Result<Option<T>> {
        let Some(i) = self.extensions.iter().position(|(n, _)| n == name) else {
            return Ok(None);
        };
        let (_, raw) = self.extensions.remove(i);
        parse(raw.get(), &at.key("extensions").key(name)).map(Some)
    }

    /// Keeps what an extension object has that the model has no place for, under the name of that extension: export writes
    /// it and the modelled members into one object.
    pub fn keep_rest(
        &mut self,
        name: &'static str,
        extensions: Option<Extensions<'a>>,
        extras: Option<&'a RawValue>,
        rest: Rest,
        at: &At<'_>,
    ) -> Result<()> {
        if extensions.is_none() && extras.is_none() && rest.0.is_none() {
            return Ok(());
        }
        let inner = Members::new(extensions, Rest::default()).finish(extras, &at.key("extensions").key(name))?;
        let mut object = rest.0.map_or_else(Map::new, |members| *members);
        if let Some(extensions) = inner.extensions {
            object.insert("extensions".to_owned(), Value::Object(*extensions));
        }
        if let Some(extras) = inner.extras {
            object.insert("extras".to_owned(), *extras);
        }
        self.kept.push((name, Value::Object(object)));
        Ok(())
    }

    /// What is left.
    pub fn finish(self, extras: Option<&'a RawValue>, at: &At<'_>) -> Result<Extra> {
        let mut extra = Extra::default();
        if let Some(raw) = extras {
            extra.extras = Some(Box::new(parse(raw.get(), &at.key("extras"))?));
        }
        extra.other = self.rest.0.map(|members| Box::new(Other { members: *members, links: Vec::new() }));
        if self.extensions.is_empty() && self.kept.is_empty() && !self.is_empty_object {
            return Ok(extra);
        }
        let mut map = Map::with_capacity(self.extensions.len() + self.kept.len());
        for (name, raw) in self.extensions {
            let value = parse(raw.get(), &at.key("extensions").key(&name))?;
            map.insert(name.into_owned(), value);
        }
        for (name, value) in self.kept {
            map.insert(name.to_owned(), value);
        }
        extra.extensions = Some(Box::new(map));
        Ok(extra)
    }
}
