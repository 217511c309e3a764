//! Hashes of values that are equal for values that are equal, by what serde says of them.

use serde::Serialize;
use serde::ser::{self, Serializer};
use std::fmt;
use std::hash::{DefaultHasher, Hash, Hasher};

/// The hash of a value without its names, which do not show: members called `name` do not count. The order of JSON members
/// does not count either, nor the sign of zero. Different values may have one hash.
pub(super) fn fingerprint(value: &impl Serialize) -> u64 {
    let mut hasher = DefaultHasher::new();
    // Nothing that is hashed can fail.
    let _ = value.serialize(Print(&mut hasher));
    hasher.finish()
}

struct Print<'h>(&'h mut DefaultHasher);

/// What a serialiser has to be able to say; hashing does not fail.
#[derive(Debug)]
pub(super) struct Never;

impl fmt::Display for Never {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a value does not describe itself")
    }
}

impl std::error::Error for Never {}

impl ser::Error for Never {
    fn custom<T: fmt::Display>(_: T) -> Self {
        Self
    }
}

macro_rules! hashed {
    ($($name:ident: $type:ty;)*) => {
        $(fn $name(self, value: $type) -> Result<(), Never> {
            value.hash(self.0);
            Ok(())
        })*
    };
}

impl<'h> Serializer for Print<'h> {
    type Ok = ();
    type Error = Never;
    type SerializeSeq = Self;
    type SerializeTuple = Self;
    type SerializeTupleStruct = Self;
    type SerializeTupleVariant = Self;
    type SerializeMap = Members<'h>;
    type SerializeStruct = Self;
    type SerializeStructVariant = Self;

    hashed! {
        serialize_bool: bool; serialize_i8: i8; serialize_i16: i16; serialize_i32: i32; serialize_i64: i64;
        serialize_u8: u8; serialize_u16: u16; serialize_u32: u32; serialize_u64: u64; serialize_char: char;
        serialize_str: &str; serialize_bytes: &[u8];
    }

    fn serialize_f32(self, value: f32) -> Result<(), Never> {
        self.serialize_f64(f64::from(value))
    }

    fn serialize_f64(self, value: f64) -> Result<(), Never> {
        // -0 is equal to 0, and added to it becomes it.
        (value + 0.0).to_bits().hash(self.0);
        Ok(())
    }

    fn serialize_none(self) -> Result<(), Never> {
        0u8.hash(self.0);
        Ok(())
    }

    fn serialize_some<T: Serialize + ?Sized>(self, value: &T) -> Result<(), Never> {
        1u8.hash(self.0);
        value.serialize(self)
    }

    fn serialize_unit(self) -> Result<(), Never> {
        self.serialize_none()
    }

    fn serialize_unit_struct(self, _: &'static str) -> Result<(), Never> {
        Ok(())
    }

    fn serialize_unit_variant(self, _: &'static str, index: u32, _: &'static str) -> Result<(), Never> {
        self.serialize_u32(index)
    }

    fn serialize_newtype_struct<T: Serialize + ?Sized>(self, _: &'static str, value: &T) -> Result<(), Never> {
        value.serialize(self)
    }

    fn serialize_newtype_variant<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        index: u32,
        _: &'static str,
        value: &T,
    ) -> Result<(), Never> {
        index.hash(self.0);
        value.serialize(self)
    }

    fn serialize_seq(self, length: Option<usize>) -> Result<Self, Never> {
        length.hash(self.0);
        Ok(self)
    }

    fn serialize_tuple(self, _: usize) -> Result<Self, Never> {
        Ok(self)
    }

    fn serialize_tuple_struct(self, _: &'static str, _: usize) -> Result<Self, Never> {
        Ok(self)
    }

    fn serialize_tuple_variant(self, _: &'static str, index: u32, _: &'static str, _: usize) -> Result<Self, Never> {
        index.hash(self.0);
        Ok(self)
    }

    fn serialize_map(self, length: Option<usize>) -> Result<Members<'h>, Never> {
        length.hash(self.0);
        Ok(Members { out: self.0, key: DefaultHasher::new(), sum: 0 })
    }

    fn serialize_struct(self, _: &'static str, _: usize) -> Result<Self, Never> {
        Ok(self)
    }

    fn serialize_struct_variant(self, _: &'static str, index: u32, _: &'static str, _: usize) -> Result<Self, Never> {
        index.hash(self.0);
        Ok(self)
    }
}

macro_rules! in_order {
    ($($trait:ident $method:ident,)*) => {
        $(impl ser::$trait for Print<'_> {
            type Ok = ();
            type Error = Never;

            fn $method<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Never> {
                value.serialize(Print(self.0))
            }

            fn end(self) -> Result<(), Never> {
                Ok(())
            }
        })*
    };
}

in_order! {
    SerializeSeq serialize_element,
    SerializeTuple serialize_element,
    SerializeTupleStruct serialize_field,
    SerializeTupleVariant serialize_field,
}

macro_rules! by_name {
    ($($trait:ident,)*) => {
        $(impl ser::$trait for Print<'_> {
            type Ok = ();
            type Error = Never;

            fn serialize_field<T: Serialize + ?Sized>(&mut self, key: &'static str, value: &T) -> Result<(), Never> {
                if key == "name" { Ok(()) } else { value.serialize(Print(self.0)) }
            }

            fn end(self) -> Result<(), Never> {
                Ok(())
            }
        })*
    };
}

by_name! { SerializeStruct, SerializeStructVariant, }

/// Members of a map, in any order.
pub(super) struct Members<'h> {
    out: &'h mut DefaultHasher,
    key: DefaultHasher,
    sum: u64,
}

impl ser::SerializeMap for Members<'_> {
    type Ok = ();
    type Error = Never;

    fn serialize_key<T: Serialize + ?Sized>(&mut self, key: &T) -> Result<(), Never> {
        self.key = DefaultHasher::new();
        key.serialize(Print(&mut self.key))
    }

    fn serialize_value<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Never> {
        value.serialize(Print(&mut self.key))?;
        self.sum = self.sum.wrapping_add(self.key.finish());
        Ok(())
    }

    fn end(self) -> Result<(), Never> {
        self.sum.hash(self.out);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Material;
    use serde_json::json;

    #[test]
    fn what_is_equal_has_one_fingerprint_and_every_member_counts() {
        let plain = Material::default();
        let named = Material { name: Some("x".to_owned()), ..plain.clone() };
        assert_eq!(fingerprint(&plain), fingerprint(&named));
        let zeros = [0.0, -0.0].map(|zero| Material { metallic: zero, ..plain.clone() });
        assert_eq!(fingerprint(&zeros[0]), fingerprint(&zeros[1]));
        let others = [
            Material { roughness: 0.5, ..plain.clone() },
            Material { double_sided: true, ..plain.clone() },
            Material { alpha_cutoff: Some(0.5), ..plain.clone() },
            Material { ior: Some(0.5), ..plain.clone() },
            Material { sheen: Some(Box::default()), ..plain.clone() },
        ];
        let mut prints: Vec<u64> = others.iter().chain([&plain]).map(fingerprint).collect();
        prints.sort_unstable();
        prints.dedup();
        assert_eq!(prints.len(), 6);
    }

    #[test]
    fn the_order_of_json_members_does_not_count() {
        let [a, b, c] = [json!({"a": 1, "b": [2]}), json!({"b": [2], "a": 1}), json!({"a": 1, "b": [3]})];
        assert_eq!(a, b);
        assert_eq!(fingerprint(&a), fingerprint(&b));
        assert_ne!(fingerprint(&a), fingerprint(&c));
        assert_ne!(fingerprint(&json!({"a": [1], "b": 2})), fingerprint(&json!({"a": 2, "b": [1]})));
    }
}
