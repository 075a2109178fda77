//! A number for the layout of a type, from the names, order and kinds of everything in it.
//!
//! `postcard` writes neither names nor kinds, so a set of parameters from another firmware would be read as nonsense.
//! Here a deserializer without data asks the type itself what it wants to read, and hashes the questions.

use core::fmt::Display;

use crc::{CRC_32_ISO_HDLC, Crc, Digest, Table};
use serde::de::value::{Error, U32Deserializer};
use serde::de::{
    Deserialize, DeserializeSeed, Deserializer, EnumAccess, Error as _, IntoDeserializer, SeqAccess, VariantAccess,
    Visitor,
};

/// Raise this when a parameter changes its unit or meaning, but neither its name nor its type.
const MEANING: u32 = 1;

const CRC: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);

/// Changes with every field or variant of `T` and of what is in it: added, removed, renamed, moved, of another type.
///
/// # Errors
/// `T` holds something whose layout depends on its data: a sequence, a map, an option, a variant with content.
pub fn layout<'de, T: Deserialize<'de>>() -> Result<u32, Error> {
    let mut digest = CRC.digest();
    digest.update(&MEANING.to_le_bytes());
    T::deserialize(Walk(&mut digest))?;
    Ok(digest.finalize())
}

struct Walk<'a>(&'a mut Digest<'static, u32, Table<1>>);

impl Walk<'_> {
    /// Hashes a word and its end.
    fn word(&mut self, word: &str) {
        self.0.update(word.as_bytes());
        self.0.update(&[0]);
    }

    fn list(&mut self, kind: &str, name: &str, members: &[&str]) {
        self.word(kind);
        self.word(name);
        members.iter().for_each(|member| self.word(member));
        self.word("");
    }
}

fn varies(what: impl Display) -> Error {
    Error::custom(format_args!("the layout of {what} depends on its data"))
}

macro_rules! plain {
    ($($ask:ident $answer:ident $value:expr),*) => {
        $(fn $ask<V: Visitor<'de>>(mut self, visitor: V) -> Result<V::Value, Error> {
            self.word(stringify!($ask));
            visitor.$answer($value)
        })*
    };
}

impl<'de> Deserializer<'de> for Walk<'_> {
    type Error = Error;

    plain!(
        deserialize_bool visit_bool false,
        deserialize_u8 visit_u8 0, deserialize_u16 visit_u16 0, deserialize_u32 visit_u32 0, deserialize_u64 visit_u64 0,
        deserialize_i8 visit_i8 0, deserialize_i16 visit_i16 0, deserialize_i32 visit_i32 0, deserialize_i64 visit_i64 0,
        deserialize_f32 visit_f32 0.0, deserialize_f64 visit_f64 0.0
    );

    fn deserialize_struct<V: Visitor<'de>>(
        mut self,
        name: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        self.list("struct", name, fields);
        visitor.visit_seq(Members { walk: self, left: fields.len() })
    }

    fn deserialize_tuple<V: Visitor<'de>>(mut self, length: usize, visitor: V) -> Result<V::Value, Error> {
        self.word("tuple");
        visitor.visit_seq(Members { walk: self, left: length })
    }

    fn deserialize_enum<V: Visitor<'de>>(
        mut self,
        name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        self.list("enum", name, variants);
        visitor.visit_enum(First)
    }

    fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, Error> {
        Err(varies("what is neither a number, an array, a struct nor an enum"))
    }

    serde::forward_to_deserialize_any! {
        char str string bytes byte_buf option unit unit_struct newtype_struct seq tuple_struct map identifier
        ignored_any
    }
}

/// The members of a struct or array, one after the other.
struct Members<'a> {
    walk: Walk<'a>,
    left: usize,
}

impl<'de> SeqAccess<'de> for Members<'_> {
    type Error = Error;

    fn next_element_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<Option<S::Value>, Error> {
        let Some(left) = self.left.checked_sub(1) else {
            self.walk.word("");
            return Ok(None);
        };
        self.left = left;
        seed.deserialize(Walk(&mut *self.walk.0)).map(Some)
    }
}

/// The first variant of an enum, which must have no content.
struct First;

impl<'de> EnumAccess<'de> for First {
    type Error = Error;
    type Variant = Self;

    fn variant_seed<S: DeserializeSeed<'de>>(self, seed: S) -> Result<(S::Value, Self), Error> {
        let first: U32Deserializer<Error> = 0u32.into_deserializer();
        Ok((seed.deserialize(first)?, Self))
    }
}

impl<'de> VariantAccess<'de> for First {
    type Error = Error;

    fn unit_variant(self) -> Result<(), Error> {
        Ok(())
    }

    fn newtype_variant_seed<S: DeserializeSeed<'de>>(self, _: S) -> Result<S::Value, Error> {
        Err(varies("a variant"))
    }

    fn tuple_variant<V: Visitor<'de>>(self, _: usize, _: V) -> Result<V::Value, Error> {
        Err(varies("a variant"))
    }

    fn struct_variant<V: Visitor<'de>>(self, _: &'static [&'static str], _: V) -> Result<V::Value, Error> {
        Err(varies("a variant"))
    }
}

#[cfg(test)]
mod tests {
    #![expect(dead_code, reason = "only the layout of these types is looked at")]
    use super::*;
    use serde::Deserialize;

    /// Fields of a set; fields of a struct in it; variants of an enum in that.
    macro_rules! number {
        ($($field:ident: $type:ty),*; $($inner:ident: $inner_type:ty),*; $($variant:ident)*) => {{
            #[derive(Deserialize)]
            struct Set { $($field: $type),* }
            #[derive(Deserialize)]
            struct Part { $($inner: $inner_type),* }
            #[derive(Deserialize)]
            enum Kind { $($variant),* }
            layout::<Set>().expect("a fixed layout")
        }};
    }

    #[test]
    fn every_change_of_the_fields_changes_the_number() {
        let numbers = [
            number!(a: f32, b: Part; c: [u16; 2], d: Kind; X Y),
            number!(a: f32, b: Part, more: f32; c: [u16; 2], d: Kind; X Y),
            number!(b: Part, a: f32; c: [u16; 2], d: Kind; X Y),
            number!(renamed: f32, b: Part; c: [u16; 2], d: Kind; X Y),
            number!(a: f64, b: Part; c: [u16; 2], d: Kind; X Y),
            number!(a: f32, b: Part; c: [u16; 3], d: Kind; X Y),
            number!(a: f32, b: Part; c: [i16; 2], d: Kind; X Y),
            number!(a: f32, b: Part; c: [u16; 2], renamed: Kind; X Y),
            number!(a: f32, b: Part; c: [u16; 2], d: Kind; Y X),
            number!(a: f32, b: Part; c: [u16; 2], d: Kind; X Y Z),
            number!(a: f32, b: Part; c: [u16; 2]; X Y),
            number!(a: f32, c: [u16; 2], d: Kind; e: f32; X Y),
        ];
        for (index, number) in numbers.iter().enumerate() {
            assert!(!numbers[..index].contains(number), "{index}: {numbers:x?}");
        }
    }

    #[test]
    fn the_same_fields_have_the_same_number() {
        assert_eq!(number!(a: f32, b: Part; c: u8; X), number!(a: f32, b: Part; c: u8; X));
    }

    #[test]
    fn the_parameters_have_a_layout() {
        assert!(layout::<control::Parameters>().is_ok());
    }

    #[test]
    fn what_has_no_fixed_layout_is_refused() {
        assert!(layout::<Option<u8>>().is_err());
        assert!(layout::<Result<u8, u8>>().is_err());
    }
}
