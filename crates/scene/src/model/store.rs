use slotmap::{Key, KeyData};
use std::marker::PhantomData;

/// Objects of one kind under stable, generational ids. Iteration is in slot order: after loading one file, that is the
/// order of the file.
///
/// Slots are filled in place (by many threads, where an import makes them so), and a slot takes no more than its object
/// where the object has a niche. The version of a slot is odd while it holds an object and rises with every change, so
/// that an id (slot and version) means one object for ever.
///
/// An object that an edit takes out of the document is parked: it stays where it is for the history, and nothing here shows
/// it until it comes back under its id. Its slot's version carries [`PARKED`], so that its id is stale as long as it lasts.
#[derive(Clone, Debug)]
pub struct Store<K: Key, V> {
    values: Vec<Option<V>>,
    versions: Vec<u32>,
    /// Slots without an object; the last one is filled next.
    free: Vec<u32>,
    parked: usize,
    keys: PhantomData<fn(K) -> K>,
}

/// The bit of a version that says that the slot's object is parked.
const PARKED: u32 = 1 << 31;

/// The version of a slot that is filled for the first time.
const FIRST_VERSION: u32 = 1;

impl<K: Key, V> Default for Store<K, V> {
    fn default() -> Self {
        Self { values: Vec::new(), versions: Vec::new(), free: Vec::new(), parked: 0, keys: PhantomData }
    }
}

impl<K: Key, V> Store<K, V> {
    /// The object, or `None` if the id is stale.
    #[inline]
    pub fn get(&self, id: K) -> Option<&V> {
        self.values[self.live_slot(id)?].as_ref()
    }

    /// Objects.
    #[inline]
    pub fn len(&self) -> usize {
        self.values.len() - self.free.len() - self.parked
    }

    /// Whether there are none.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// All objects with their ids, in slot order.
    pub fn iter(&self) -> impl Iterator<Item = (K, &V)> {
        let objects = self.values.iter().zip(&self.versions).enumerate();
        let seen = objects.filter(|(_, (_, version))| **version & PARKED == 0);
        seen.filter_map(|(slot, (value, &version))| Some((Self::id(slot, version), value.as_ref()?)))
    }

    /// All objects, in slot order, to be changed.
    pub(crate) fn values_mut(&mut self) -> impl Iterator<Item = &mut V> {
        let seen = self.values.iter_mut().zip(&self.versions).filter(|(_, version)| **version & PARKED == 0);
        seen.filter_map(|(value, _)| value.as_mut())
    }

    /// All objects, in slot order.
    pub fn values(&self) -> impl Iterator<Item = &V> {
        self.iter().map(|(_, value)| value)
    }

    /// All ids, in slot order.
    pub fn ids(&self) -> impl Iterator<Item = K> + '_ {
        self.iter().map(|(id, _)| id)
    }

    /// The slot of an id, for dense side tables: below [`Store::slot_bound`], and unique among live ids.
    #[inline]
    pub fn slot(id: K) -> usize {
        // In an id, slots count from 1: the low half of its FFI form.
        (id.data().as_ffi() as u32 as usize).wrapping_sub(1)
    }

    /// One past the largest slot that was ever used.
    pub fn slot_bound(&self) -> usize {
        self.values.len()
    }

    /// Bytes of the slots; what the objects own besides is not counted.
    pub fn slot_bytes(&self) -> usize {
        self.values.len() * (size_of::<Option<V>>() + size_of::<u32>())
    }

    /// A store whose object number `i` has the id [`Store::nth_id`]`(i)`.
    ///
    /// # Panics
    /// If an element is `None`, or there are as many as ids cannot number.
    pub(crate) fn from_values(values: Vec<Option<V>>) -> Self {
        assert!(values.iter().all(Option::is_some), "every slot of a new store holds an object");
        assert!(values.len() < u32::MAX as usize, "an id has 32 bits for its slot");
        let versions = vec![FIRST_VERSION; values.len()];
        Self { values, versions, free: Vec::new(), parked: 0, keys: PhantomData }
    }

    pub(crate) fn reserve(&mut self, additional: usize) {
        self.values.reserve(additional);
        self.versions.reserve(additional);
    }

    pub(crate) fn insert(&mut self, value: V) -> K {
        let slot = match self.free.pop() {
            Some(slot) => {
                let slot = slot as usize;
                self.versions[slot] += 1;
                self.values[slot] = Some(value);
                slot
            }
            None => {
                // Slot u32::MAX - 1 is that of the null id.
                assert!(self.values.len() < u32::MAX as usize - 1, "an id has 32 bits for its slot");
                self.values.push(Some(value));
                self.versions.push(FIRST_VERSION);
                self.values.len() - 1
            }
        };
        Self::id(slot, self.versions[slot])
    }

    /// The id that the object inserted as number `index` (from 0) into an empty store will have: known before it is
    /// there, so that an import may refer to what comes later.
    pub(crate) fn nth_id(index: usize) -> K {
        Self::id(index, FIRST_VERSION)
    }

    /// Inserts object number `index` of a new store.
    ///
    /// # Panics
    /// If its id is not [`Store::nth_id`]: then ids that were given out before would be wrong.
    pub(crate) fn insert_nth(&mut self, index: usize, value: V) -> K {
        let id = self.insert(value);
        assert!(id == Self::nth_id(index), "object {index} went to another slot");
        id
    }

    pub(crate) fn get_mut(&mut self, id: K) -> Option<&mut V> {
        let slot = self.live_slot(id)?;
        self.values[slot].as_mut()
    }

    /// The object in a slot, if there is one: for references by the index of the file that was loaded.
    pub fn id_in_slot(&self, slot: usize) -> Option<K> {
        let version = *self.versions.get(slot)?;
        (self.values[slot].is_some() && version & PARKED == 0).then(|| Self::id(slot, version))
    }

    /// Inserts an object that is parked: it has an id, and nobody sees it yet.
    pub(crate) fn insert_parked(&mut self, value: V) -> K {
        let id = self.insert(value);
        self.set_parked(id, true);
        id
    }

    /// Takes an object out of the document, or back in. Whether it was the other way before.
    pub(crate) fn set_parked(&mut self, id: K, parked: bool) -> bool {
        let Some(slot) = self.held_slot(id).filter(|&slot| (self.versions[slot] & PARKED != 0) != parked) else {
            return false;
        };
        self.versions[slot] ^= PARKED;
        self.parked = if parked { self.parked + 1 } else { self.parked - 1 };
        true
    }

    /// An object, parked or not.
    pub(crate) fn get_any(&self, id: K) -> Option<&V> {
        self.values[self.held_slot(id)?].as_ref()
    }

    /// All objects, parked or not, in slot order.
    pub(crate) fn all(&self) -> impl Iterator<Item = &V> {
        self.values.iter().flatten()
    }

    /// [`Store::get_any`], to be changed.
    pub(crate) fn get_any_mut(&mut self, id: K) -> Option<&mut V> {
        let slot = self.held_slot(id)?;
        self.values[slot].as_mut()
    }

    /// Ends an object that is parked: its id is stale from now on, and its slot is free.
    pub(crate) fn purge(&mut self, id: K) -> Option<V> {
        let slot = self.held_slot(id).filter(|&slot| self.versions[slot] & PARKED != 0)?;
        self.parked -= 1;
        self.versions[slot] = (self.versions[slot] & !PARKED) + 1;
        // After a thousand million objects a slot has no new version left, and is given up.
        if self.versions[slot] < PARKED - 2 {
            self.free.push(slot as u32);
        }
        self.values[slot].take()
    }

    /// Takes an object out for good, whoever refers to it.
    #[cfg(test)]
    pub(crate) fn remove(&mut self, id: K) -> Option<V> {
        self.set_parked(id, true);
        self.purge(id)
    }

    /// Objects that are parked.
    pub(crate) fn parked(&self) -> usize {
        self.parked
    }

    /// The slot of an object, parked or not.
    fn held_slot(&self, id: K) -> Option<usize> {
        let slot = Self::slot(id);
        let version = (id.data().as_ffi() >> 32) as u32;
        (*self.versions.get(slot)? & !PARKED == version).then_some(slot)
    }

    #[inline]
    fn id(slot: usize, version: u32) -> K {
        KeyData::from_ffi((u64::from(version) << 32) | (slot as u64 + 1)).into()
    }

    /// The slot of an id that is not stale. Ids have odd versions, so such a slot holds an object.
    #[inline]
    fn live_slot(&self, id: K) -> Option<usize> {
        let slot = Self::slot(id);
        let version = (id.data().as_ffi() >> 32) as u32;
        (*self.versions.get(slot)? == version).then_some(slot)
    }
}

impl<K: Key, V> std::ops::Index<K> for Store<K, V> {
    type Output = V;

    /// # Panics
    /// If the id is stale. Ids that the document itself holds are never stale.
    #[inline]
    fn index(&self, id: K) -> &V {
        self.get(id).expect("the id is not stale")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::NodeId;

    type Names = Store<NodeId, &'static str>;

    #[test]
    fn an_id_means_one_object_for_ever() {
        let mut store = Names::default();
        let (a, b) = (store.insert("a"), store.insert("b"));
        assert!(store.set_parked(a, true));
        assert_eq!(store.purge(a), Some("a"));
        assert_eq!((store.purge(a), store.purge(b)), (None, None));
        assert_eq!((store.get(a), store.get_any(a), store.len()), (None, None, 1));
        let c = store.insert("c");
        assert_eq!((Names::slot(c), store.slot_bound()), (Names::slot(a), 2), "the slot is used again");
        assert_ne!(a, c);
        assert_eq!((store.get(a), store.get(b), store.get(c)), (None, Some(&"b"), Some(&"c")));
        *store.get_mut(c).unwrap() = "d";
        assert_eq!(store.iter().collect::<Vec<_>>(), [(c, &"d"), (b, &"b")], "in slot order");
    }

    #[test]
    fn a_parked_object_is_not_seen_and_comes_back_under_its_id() {
        let mut store = Names::default();
        let [a, b, c] = ["a", "b", "c"].map(|value| store.insert(value));
        assert!(store.set_parked(b, true));
        assert!(!store.set_parked(b, true));
        assert_eq!((store.len(), store.parked(), store.get(b), store.get_any(b)), (2, 1, None, Some(&"b")));
        assert_eq!(store.values().copied().collect::<String>(), "ac");
        assert_eq!(store.values_mut().map(|value| *value).collect::<String>(), "ac");
        assert_eq!(store.ids().collect::<Vec<_>>(), [a, c]);
        assert_eq!((store.id_in_slot(0), store.id_in_slot(1), store.id_in_slot(3)), (Some(a), None, None));
        // What comes while it is parked takes another slot.
        store.insert("d");
        assert!(store.set_parked(b, false));
        assert_eq!(store.values().copied().collect::<String>(), "abcd");
        assert_eq!(store.get(b), Some(&"b"));
    }

    #[test]
    fn objects_that_come_in_order_have_ids_that_are_known_before() {
        let mut one_by_one = Names::default();
        let at_once = Names::from_values(vec![Some("a"), Some("b")]);
        for (i, name) in ["a", "b"].into_iter().enumerate() {
            let id = one_by_one.insert_nth(i, name);
            assert_eq!((id, Names::slot(id)), (Names::nth_id(i), i));
            assert_eq!(at_once.get(id), Some(&name));
        }
        assert_eq!(at_once.get(Names::nth_id(2)), None);
    }

    #[test]
    fn the_null_id_is_stale() {
        let store = Names::from_values(vec![Some("a")]);
        assert_eq!(store.get(NodeId::default()), None);
    }

    #[test]
    fn a_slot_of_a_node_takes_no_more_than_the_node() {
        assert_eq!(size_of::<Option<crate::model::Node>>(), size_of::<crate::model::Node>());
        println!("{} bytes", size_of::<crate::model::Node>());
    }
}
