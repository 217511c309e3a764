//! References inside extensions that are kept as JSON, when what they mean goes.

use crate::model::{AnyId, Extra, Link};
use rustc_hash::FxHashSet;
use serde_json::Value;

/// Takes the references to objects that go out of what an object carries. An element of a list goes alone; a reference
/// that is the member of an object goes with its extension, which means nothing without it.
pub fn drop_links(extra: &mut Extra, gone: &FxHashSet<AnyId>) {
    let dead: Vec<Link> = extra.links().iter().filter(|link| gone.contains(&link.target)).cloned().collect();
    // From the last to the first: taking an element out moves those behind it.
    for link in dead.iter().rev() {
        match list_element(extra, &link.path) {
            Some((list, index)) => remove_element(extra, &list, index),
            None => remove_extension(extra, &link.path),
        }
    }
    if extra.extensions.as_ref().is_some_and(|extensions| extensions.is_empty()) {
        extra.extensions = None;
    }
    if extra.other.as_ref().is_some_and(|other| other.links.is_empty() && other.members.is_empty()) {
        extra.other = None;
    }
}

/// The extensions as one value, so that JSON pointers lead into it.
fn with_value<T>(extra: &mut Extra, act: impl FnOnce(&mut Value) -> T) -> Option<T> {
    let extensions = extra.extensions.take()?;
    let mut value = Value::Object(*extensions);
    let result = act(&mut value);
    if let Value::Object(extensions) = value {
        extra.extensions = Some(Box::new(extensions));
    }
    Some(result)
}

/// The list that a path leads into, and the index in it.
fn list_element(extra: &mut Extra, path: &str) -> Option<(String, usize)> {
    let (list, index) = path.rsplit_once('/')?;
    let index = index.parse().ok()?;
    with_value(extra, |value| value.pointer(list).is_some_and(Value::is_array))?.then(|| (list.to_owned(), index))
}

fn remove_element(extra: &mut Extra, list: &str, index: usize) {
    let left = with_value(extra, |value| {
        let elements = value.pointer_mut(list).and_then(Value::as_array_mut)?;
        if index < elements.len() {
            elements.remove(index);
        }
        Some(elements.len())
    });
    if left.flatten() == Some(0) {
        return remove_extension(extra, list);
    }
    let Some(other) = &mut extra.other else { return };
    let inside = format!("{list}/");
    let place = |link: &Link| link.path.strip_prefix(&*inside)?.parse::<usize>().ok();
    other.links.retain(|link| place(link) != Some(index));
    for link in &mut other.links {
        if let Some(old) = place(link)
            && old > index
        {
            link.path = format!("{inside}{}", old - 1).into();
        }
    }
}

fn remove_extension(extra: &mut Extra, path: &str) {
    let name = path.trim_start_matches('/').split('/').next().unwrap_or_default();
    let (prefix, name) = (format!("/{name}"), name.replace("~1", "/").replace("~0", "~"));
    if let Some(extensions) = &mut extra.extensions {
        // The order of the others stays.
        extensions.shift_remove(&name);
    }
    if let Some(other) = &mut extra.other {
        other.links.retain(|link| {
            link.path.strip_prefix(&*prefix).is_none_or(|rest| !rest.is_empty() && !rest.starts_with('/'))
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{NodeId, Other, Store};
    use serde_json::json;

    fn node(i: usize) -> AnyId {
        Store::<NodeId, ()>::nth_id(i).into()
    }

    fn lod(ids: &[usize]) -> Extra {
        let Value::Object(extensions) = json!({"MSFT_lod": {"ids": ids}, "X": 1}) else { unreachable!() };
        let links =
            ids.iter().enumerate().map(|(i, &id)| Link { path: format!("/MSFT_lod/ids/{i}").into(), target: node(id) });
        let other = Other { links: links.collect(), ..Other::default() };
        Extra { extensions: Some(Box::new(extensions)), other: Some(Box::new(other)), ..Extra::default() }
    }

    #[test]
    fn an_element_that_goes_leaves_the_others_linked() {
        let mut extra = lod(&[5, 6, 7, 8]);
        drop_links(&mut extra, &FxHashSet::from_iter([node(6), node(7)]));
        assert_eq!(extra, lod(&[5, 8]));
    }

    #[test]
    fn an_extension_without_its_reference_goes() {
        let mut extra = lod(&[5]);
        drop_links(&mut extra, &FxHashSet::from_iter([node(5)]));
        assert_eq!(Value::Object(*extra.extensions.unwrap()), json!({"X": 1}));
        assert_eq!(extra.other, None);
    }
}
