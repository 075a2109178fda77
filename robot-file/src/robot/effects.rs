//! `[effects.NAME]`: what the model has beyond the linear motor. Names, keys and ranges are the catalogue's ([`effects`]).

use std::collections::BTreeMap;

use effects::{Effect, Id, Laws, Parameter};
use serde::ser::{Serialize, SerializeMap, Serializer};

use super::Quantity;
use crate::schema::{Field, Part, Place, Reader, Shape, TomlTable, read_as_table};
use crate::tree::Table;

/// `[effects.NAME]`: a table that is there is an effect that the model has.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Effects {
    /// Quantities in the order of the effect's parameters.
    tables: BTreeMap<Id, Vec<Quantity>>,
}

impl Effects {
    /// The effects that the file lists, in the order of the catalogue.
    pub fn listed(&self) -> impl Iterator<Item = Id> + '_ {
        self.tables.keys().copied()
    }

    /// Whether the file lists an effect.
    #[must_use]
    pub fn has(&self, id: Id) -> bool {
        self.tables.contains_key(&id)
    }

    /// The law of an effect at the file's values, SI units and radians; `None` where the file does not list it.
    ///
    /// ```
    /// # fn drop_at_rest(robot: &robot_file::Robot) -> f64 {
    /// robot.effects.get::<effects::DriverDrop>().map_or(0.0, |drop| drop.drop_v)
    /// # }
    /// ```
    #[must_use]
    pub fn get<E: Effect>(&self) -> Option<E> {
        Id::of(E::SPEC.name).and_then(|id| self.values(id)).map(|values| E::from_values(&values))
    }

    /// An effect's values in the order of its parameters, SI units and radians.
    #[must_use]
    pub fn values(&self, id: Id) -> Option<Vec<f64>> {
        self.in_si(id, |quantity| quantity.value)
    }

    /// Half the plausible range of an effect's values, SI units and radians.
    #[must_use]
    pub fn half_ranges(&self, id: Id) -> Option<Vec<f64>> {
        self.in_si(id, |quantity| 0.5 * (quantity.high - quantity.low).abs())
    }

    fn in_si(&self, id: Id, of: impl Fn(&Quantity) -> f64) -> Option<Vec<f64>> {
        let quantities = self.tables.get(&id)?;
        Some(id.spec().parameters.iter().zip(quantities).map(|(key, quantity)| key.to_si(of(quantity))).collect())
    }

    /// All laws at the file's values.
    #[must_use]
    pub fn laws(&self) -> Laws {
        let mut laws = Laws::NONE;
        for id in self.listed() {
            id.put(&mut laws, self.values(id).as_deref());
        }
        laws
    }

    /// The file's quantity under a key of an effect's table.
    #[must_use]
    pub fn quantity(&self, name: &str, key: &str) -> Option<&Quantity> {
        let id = Id::of(name)?;
        self.tables.get(&id)?.get(place(id, key)?)
    }

    /// The same, to be changed.
    pub fn quantity_mut(&mut self, name: &str, key: &str) -> Option<&mut Quantity> {
        let id = Id::of(name)?;
        let place = place(id, key)?;
        self.tables.get_mut(&id)?.get_mut(place)
    }

    /// Every quantity with its effect and parameter, to be changed.
    pub fn quantities_mut(&mut self) -> impl Iterator<Item = (Id, &'static Parameter, &mut Quantity)> {
        self.tables.iter_mut().flat_map(|(&id, quantities)| {
            let parameters = id.spec().parameters.iter();
            parameters.zip(quantities).map(move |(parameter, quantity)| (id, parameter, quantity))
        })
    }

    /// Lists an effect with quantities in the order of its parameters. Neither their ranges nor their number are checked
    /// against the catalogue's: a file's are, when it is read.
    ///
    /// # Panics
    /// The effect is not of the catalogue, or has another number of parameters.
    pub fn insert<E: Effect>(&mut self, quantities: Vec<Quantity>) {
        assert_eq!(quantities.len(), E::SPEC.parameters.len(), "quantities of {}", E::SPEC.name);
        let id = Id::of(E::SPEC.name);
        self.tables.insert(id.unwrap_or_else(|| panic!("{} is not in the catalogue", E::SPEC.name)), quantities);
    }

    /// Takes an effect off the list; whether it was there.
    pub fn remove(&mut self, name: &str) -> bool {
        Id::of(name).is_some_and(|id| self.tables.remove(&id).is_some())
    }
}

fn place(id: Id, key: &str) -> Option<usize> {
    id.spec().parameters.iter().position(|parameter| parameter.key == key)
}

impl Serialize for Effects {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.tables.len()))?;
        for (id, quantities) in &self.tables {
            let table: BTreeMap<_, _> = id.spec().parameters.iter().map(|one| one.key).zip(quantities).collect();
            map.serialize_entry(id.name(), &table)?;
        }
        map.end()
    }
}

impl TomlTable for Effects {
    fn fields() -> Vec<Field> {
        Id::all()
            .map(|id| Field {
                key: id.name(),
                meaning: id.spec().summary,
                optional: true,
                shape: Shape::Table(parameter_fields(id)),
            })
            .collect()
    }

    fn read_fields(reader: &mut Reader, table: &Table, path: &str) -> Option<Self> {
        let mut effects = Some(Self::default());
        for id in Id::all() {
            let place = Place { table, path, key: id.name(), meaning: id.spec().summary };
            if place.entry().is_none() {
                continue;
            }
            let quantities = read_parameters(reader, &place, id);
            effects = effects.zip(quantities).map(|(mut effects, quantities)| {
                effects.tables.insert(id, quantities);
                effects
            });
        }
        effects
    }
}

fn parameter_fields(id: Id) -> Vec<Field> {
    let field = |one: &'static Parameter| Field {
        key: one.key,
        meaning: one.meaning,
        optional: false,
        shape: Shape::Quantity(one.low, one.high),
    };
    id.spec().parameters.iter().map(field).collect()
}

fn read_parameters(reader: &mut Reader, place: &Place<'_>, id: Id) -> Option<Vec<Quantity>> {
    let path = place.field();
    let table = reader.need_table(place)?;
    let known: Vec<_> = id.spec().parameters.iter().map(|one| one.key).collect();
    reader.refuse_unknown(table, &path, &known);
    let read = |one: &Parameter| {
        let place = Place { table, path: &path, key: one.key, meaning: one.meaning };
        Quantity::read(reader, &place, &(one.low..=one.high))
    };
    // All are read before any is missed: every mistake is told at once.
    let quantities: Vec<Option<Quantity>> = id.spec().parameters.iter().map(read).collect();
    quantities.into_iter().collect()
}

impl Part for Effects {
    type Spec = ();

    fn shape((): &()) -> Shape {
        Shape::Table(Self::fields())
    }

    fn read(reader: &mut Reader, place: &Place<'_>, (): &()) -> Option<Self> {
        read_as_table(reader, place)
    }
}
