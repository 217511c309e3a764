use slotmap::{Key, KeyData, SlotMap};

/// Objects of one kind under stable, generational ids. Iteration is in slot order: after loading one file, that is the
/// order of the file.
#[derive(Clone, Debug)]
pub struct Store<K: Key, V>(SlotMap<K, V>);

impl<K: Key, V> Default for Store<K, V> {
    fn default() -> Self {
        Self(SlotMap::with_key())
    }
}

impl<K: Key, V> Store<K, V> {
    /// The object, or `None` if the id is stale.
    #[inline]
    pub fn get(&self, id: K) -> Option<&V> {
        self.0.get(id)
    }

    /// Objects.
    #[inline]
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there are none.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// All objects with their ids, in slot order.
    pub fn iter(&self) -> impl Iterator<Item = (K, &V)> {
        self.0.iter()
    }

    /// All objects, in slot order, to be changed.
    pub(crate) fn values_mut(&mut self) -> impl Iterator<Item = &mut V> {
        self.0.values_mut()
    }

    /// All objects, in slot order.
    pub fn values(&self) -> impl Iterator<Item = &V> {
        self.0.values()
    }

    /// All ids, in slot order.
    pub fn ids(&self) -> impl Iterator<Item = K> + '_ {
        self.0.keys()
    }

    /// The slot of an id, for dense side tables: below [`Store::slot_bound`], and unique among live ids.
    #[inline]
    pub fn slot(id: K) -> usize {
        // slotmap's slots begin at 1 (0 is its sentinel), and the low half of its FFI form is the slot.
        (id.data().as_ffi() as u32 as usize).wrapping_sub(1)
    }

    /// One past the largest slot that was ever used.
    pub fn slot_bound(&self) -> usize {
        self.0.capacity()
    }

    pub(crate) fn reserve(&mut self, additional: usize) {
        self.0.reserve(additional);
    }

    pub(crate) fn insert(&mut self, value: V) -> K {
        self.0.insert(value)
    }

    /// The id that the object inserted as number `index` (from 0) into an empty store will have: known before it is
    /// there, so that an import may refer to what comes later.
    pub(crate) fn nth_id(index: usize) -> K {
        // Slots begin at 1, and the first generation is 1.
        KeyData::from_ffi((1 << 32) | (index as u64 + 1)).into()
    }

    /// Inserts object number `index` of a new store.
    ///
    /// # Panics
    /// If its id is not [`Store::nth_id`]: then ids that were given out before would be wrong.
    pub(crate) fn insert_nth(&mut self, index: usize, value: V) -> K {
        let id = self.0.insert(value);
        assert!(id == Self::nth_id(index), "object {index} went to another slot");
        id
    }

    #[cfg_attr(not(test), expect(dead_code, reason = "edits will remove objects"))]
    pub(crate) fn remove(&mut self, id: K) -> Option<V> {
        self.0.remove(id)
    }

    pub(crate) fn get_mut(&mut self, id: K) -> Option<&mut V> {
        self.0.get_mut(id)
    }
}

impl<K: Key, V> std::ops::Index<K> for Store<K, V> {
    type Output = V;

    /// # Panics
    /// If the id is stale. Ids that the document itself holds are never stale.
    #[inline]
    fn index(&self, id: K) -> &V {
        &self.0[id]
    }
}
