//! Reads the section of the workpiece, whose keys depend on its kind.

use bristle::model::parameters::{Parameter, Violation, left_out};
use bristle::model::settings::{ProfileSettings, WorkpieceKind, WorkpieceSettings};
use serde_json::Value;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Error};

use super::Document;
use super::tree::read;
use crate::input::control_points::MAX_CONTROL_POINTS;
use crate::input::input_error::InputError;
use crate::input::keys::{CONTROL_POINTS, WORKPIECE};
use crate::input::schema::workpiece_kinds;

/// Keys of a workpiece of any kind.
pub(super) const KIND: &str = "kind";
pub(super) const FEED: &str = "feed_velocity_m_s";
/// Key of a plane that other kinds have, too, but do not state.
const NORMAL: &str = "normal";

impl Document<'_> {
    /// Reads the section of the workpiece of a `table`. Keys of another kind may have their
    /// defaults only.
    pub(super) fn read_workpiece(
        &self,
        table: &DeTable<'_>,
        section: Spanned<DeValue<'_>>,
    ) -> Result<WorkpieceSettings, InputError> {
        let (span, DeValue::Table(mut keys)) = (section.span(), section.into_inner()) else {
            unreachable!("a document has sections only")
        };
        let kinds = workpiece_kinds();
        let stated = keys.remove(KIND);
        let kind = stated
            .as_ref()
            .map_or(Some(WorkpieceKind::default().name()), |kind| {
                kind.get_ref().as_str()
            });
        let Some((kind, own)) = kind.and_then(|kind| kinds.iter().find(|(name, _)| name == kind))
        else {
            let names: Vec<String> = kinds.iter().map(|(name, _)| format!("`{name}`")).collect();
            let stated = stated.as_ref().expect("the default is a kind");
            let allowed = format!("one of {}", names.join(", "));
            return Err(self.not_allowed(&format!("{WORKPIECE}.{KIND}"), stated, allowed));
        };
        let feed = keys.remove(FEED);
        let mut others = Vec::new();
        for (key, value) in &keys {
            let name = key.get_ref().as_ref();
            let Some(default) = kinds
                .iter()
                .find_map(|(_, of_kind)| of_kind.get(name))
                .filter(|_| !own.contains_key(name))
            else {
                continue;
            };
            if !read(value).is_ok_and(|value: Value| is_same(&value, default)) {
                let path = format!("{WORKPIECE}.{name}");
                let allowed = match name {
                    NORMAL => format!("left out: a workpiece of kind `{kind}` faces along y"),
                    _ => left_out(kind),
                };
                return Err(match (Parameter::find(&path), read(value)) {
                    (Some(parameter), Ok(number)) => {
                        let value = parameter.format(number);
                        self.violated(
                            table,
                            Violation {
                                path: parameter.path,
                                value,
                                allowed,
                            },
                        )
                    }
                    _ => self.not_allowed(&path, value, allowed),
                });
            }
            others.push(name.to_owned());
        }
        others
            .iter()
            .for_each(|other| drop(keys.remove(other.as_str())));
        let read_all = || {
            let feed_velocity_m_s = feed.map_or(Ok(0.0), |feed| read(&feed))?;
            let keys = Spanned::new(span, DeValue::Table(keys));
            Ok(WorkpieceSettings {
                feed_velocity_m_s,
                kind: of_kind(kind, &keys)?,
            })
        };
        let mut workpiece = read_all().map_err(|error: Error| self.unreadable(table, &error))?;
        let is_from_file = self.control_points_file.is_some();
        let wrong = |count: usize, allowed| {
            let value = format!("{count} points");
            Err(self.violated(
                table,
                Violation {
                    path: CONTROL_POINTS,
                    value,
                    allowed,
                },
            ))
        };
        match &mut workpiece.kind {
            WorkpieceKind::Profile(ProfileSettings {
                control_points_m: points,
                ..
            }) => {
                if is_from_file {
                    points.clone_from(&self.control_points);
                }
                if points.len() > MAX_CONTROL_POINTS {
                    return wrong(
                        points.len(),
                        format!("a list of at most {MAX_CONTROL_POINTS} points"),
                    );
                }
            }
            _ if is_from_file => return wrong(self.control_points.len(), left_out(kind)),
            _ => {}
        }
        Ok(workpiece)
    }
}

/// Reads the `keys` of a workpiece of a kind into the structure of this kind. Unlike in
/// [`WorkpieceKind`], keys keep their places in errors.
fn of_kind(kind: &str, keys: &Spanned<DeValue<'_>>) -> Result<WorkpieceKind, Error> {
    Ok(match kind {
        "edge" => WorkpieceKind::Edge(read(keys)?),
        "chamfer" => WorkpieceKind::Chamfer(read(keys)?),
        "cylinder" => WorkpieceKind::Cylinder(read(keys)?),
        "bore" => WorkpieceKind::Bore(read(keys)?),
        "profile" => WorkpieceKind::Profile(read(keys)?),
        _ => WorkpieceKind::Plane(read(keys)?),
    })
}

/// Returns `true` if two values are equal, however their numbers are written.
fn is_same(one: &Value, other: &Value) -> bool {
    match (one, other) {
        (Value::Array(one), Value::Array(other)) => {
            one.len() == other.len()
                && one
                    .iter()
                    .zip(other)
                    .all(|(one, other)| is_same(one, other))
        }
        (Value::Number(one), Value::Number(other)) => one.as_f64() == other.as_f64(),
        _ => one == other,
    }
}
