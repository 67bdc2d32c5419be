//! Single values between TOML and the types of the scene.

use toml::{Table as Plain, Value};

use super::instrument::{Chip, Psf, Table};
use super::keys::children;
use super::schema::Given;
use super::types::{Crop, Method, SkyModel};

/// A value of one key.
pub(super) trait Field: Sized {
    /// From TOML; nothing where the key is absent and may be, or holds `"auto"`.
    fn read(value: Option<&Value>) -> Option<Self>;
    /// To TOML; nothing: the key takes its default or is left out.
    fn write(&self) -> Option<Value>;
}

/// A table as its type.
pub(super) trait Section: Sized {
    fn read(table: &Plain) -> Result<Self, String>;
    fn write(&self, table: &mut Plain);
}

/// A table within a table; the error is its name.
pub(super) fn inner<'a>(table: &'a Plain, name: &str) -> Result<&'a Plain, String> {
    table.get(name).and_then(Value::as_table).ok_or_else(|| name.to_string())
}

macro_rules! field {
    ($type:ty, $value:ident => $read:expr, $own:ident => $write:expr) => {
        impl Field for $type {
            fn read(value: Option<&Value>) -> Option<Self> {
                let $value = value?;
                $read
            }
            fn write(&self) -> Option<Value> {
                let $own = self;
                Some($write)
            }
        }
    };
}

/// Words of an enum without further content.
macro_rules! words {
    ($type:ty, $($word:literal = $variant:path),+) => {
        field!($type,
            v => match v.as_str()? { $($word => Some($variant),)+ _ => None },
            own => match own { $($variant => $word.into(),)+ });
    };
}

field!(f64, v => v.as_float(), own => Value::Float(*own));
field!(i64, v => v.as_integer(), own => Value::Integer(*own));
field!(usize, v => v.as_integer()?.try_into().ok(), own => integer(*own));
field!(u64, v => v.as_integer()?.try_into().ok(), own => integer(*own));
field!(u32, v => v.as_integer()?.try_into().ok(), own => integer(*own));
field!(bool, v => v.as_bool(), own => Value::Boolean(*own));
field!(String, v => v.as_str().map(str::to_string), own => own.as_str().into());
words!(Chip, "ccd" = Chip::Ccd, "cmos" = Chip::Cmos);
words!(Method, "optimal" = Method::Optimal, "aperture" = Method::Aperture, "joint" = Method::Joint);
field!(Table, v => v.as_str().map(|name| Table::Named(name.into())), own => match own {
    Table::Named(name) => name.as_str().into(),
    Table::File(path) => path.to_string_lossy().into_owned().into(),
});
field!(Psf, v => Some(match v.as_str()? {
    "gaussian" => Psf::Gaussian,
    "moffat" => Psf::Moffat,
    "airy" => Psf::Airy,
    "kolmogorov" => Psf::Kolmogorov,
    file => Psf::Image(file.into()),
}), own => match own {
    Psf::Gaussian => "gaussian".into(),
    Psf::Moffat => "moffat".into(),
    Psf::Airy => "airy".into(),
    Psf::Kolmogorov => "kolmogorov".into(),
    Psf::Image(path) => path.to_string_lossy().into_owned().into(),
});
field!(SkyModel, v => Some(match v {
    Value::String(word) if word == "auto" => SkyModel::Auto,
    Value::String(word) if word == "off" => SkyModel::Off,
    Value::String(word) => SkyModel::Named(word.clone()),
    value => SkyModel::Surface(value.as_float()?),
}), own => match own {
    SkyModel::Auto => "auto".into(),
    SkyModel::Off => "off".into(),
    SkyModel::Named(name) => name.as_str().into(),
    SkyModel::Surface(mag) => Value::Float(*mag),
});
field!(Crop, v => match v {
    Value::String(word) => Some(if word == "target" { Crop::Target } else { Crop::None }),
    value => <[usize; 4]>::read(Some(value)).map(Crop::Rect),
}, own => match own {
    Crop::None => "none".into(),
    Crop::Target => "target".into(),
    Crop::Rect(sides) => Value::Array(sides.iter().map(|side| integer(*side)).collect()),
});

impl<T: Field> Field for Vec<T> {
    fn read(value: Option<&Value>) -> Option<Self> {
        value?.as_array()?.iter().map(|item| T::read(Some(item))).collect()
    }
    fn write(&self) -> Option<Value> {
        Some(Value::Array(self.iter().filter_map(T::write).collect()))
    }
}

impl<T: Field, const N: usize> Field for [T; N] {
    fn read(value: Option<&Value>) -> Option<Self> {
        Vec::read(value)?.try_into().ok()
    }
    fn write(&self) -> Option<Value> {
        Some(Value::Array(self.iter().filter_map(T::write).collect()))
    }
}

impl Field for Option<f64> {
    fn read(value: Option<&Value>) -> Option<Self> {
        Some(value.and_then(Value::as_float))
    }
    fn write(&self) -> Option<Value> {
        self.map(Value::Float)
    }
}

impl Field for Option<String> {
    fn read(value: Option<&Value>) -> Option<Self> {
        Some(value.and_then(Value::as_str).map(str::to_string))
    }
    fn write(&self) -> Option<Value> {
        self.as_deref().map(Value::from)
    }
}

/// A count or seed as TOML.
pub(super) fn integer(value: impl TryInto<i64>) -> Value {
    Value::Integer(value.try_into().unwrap_or(i64::MAX))
}

/// A key as its type; the error is the key's name.
pub(super) fn get<T: Field>(table: &Plain, name: &str) -> Result<T, String> {
    T::read(table.get(name)).ok_or_else(|| name.to_string())
}

/// Writes a key back; where the value is none, `"auto"` if that is the default, else nothing.
pub(super) fn put<T: Field>(table: &mut Plain, form: &str, name: &str, value: &T) {
    let auto = || children(form).any(|key| key.name() == name && key.given == Given::Is("\"auto\""));
    match value.write() {
        Some(value) => table.insert(name.into(), value),
        None if auto() => table.insert(name.into(), "auto".into()),
        None => table.remove(name),
    };
}
