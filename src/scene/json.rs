//! A JSON value that knows its path, so that every fault can name the place in the file.

use serde_json::Value;

/// A checked read: the fault is a sentence that begins with a JSON path.
pub(super) type Checked<T> = Result<T, String>;

/// A borrowed JSON value with its JSON pointer, like `/materials/3/ior`.
#[derive(Debug, Clone)]
pub(super) struct Json<'a> {
    value: &'a Value,
    path: String,
}

impl<'a> Json<'a> {
    pub fn root(value: &'a Value) -> Self {
        Self {
            value,
            path: String::new(),
        }
    }

    /// The JSON pointer; empty for the root.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// `what` is wrong here.
    pub fn fault(&self, what: impl std::fmt::Display) -> String {
        match self.path.as_str() {
            "" => format!("/: {what}"),
            path => format!("{path}: {what}"),
        }
    }

    /// The member `key` of this object, where there is one.
    pub fn get(&self, key: &str) -> Checked<Option<Json<'a>>> {
        let object = self
            .value
            .as_object()
            .ok_or_else(|| self.fault("must be an object"))?;
        Ok(object.get(key).map(|value| Json {
            value,
            path: format!("{}/{key}", self.path),
        }))
    }

    /// The member `key`, which must be there.
    pub fn need(&self, key: &str) -> Checked<Json<'a>> {
        self.get(key)?
            .ok_or_else(|| self.fault(format_args!("lacks \"{key}\"")))
    }

    /// The extension `name` of this object, where there is one.
    pub fn extension(&self, name: &str) -> Checked<Option<Json<'a>>> {
        match self.get("extensions")? {
            Some(extensions) => extensions.get(name),
            None => Ok(None),
        }
    }

    /// The elements of the array `key`; none where it is absent.
    pub fn items(&self, key: &str) -> Checked<Vec<Json<'a>>> {
        let Some(array) = self.get(key)? else {
            return Ok(Vec::new());
        };
        Ok(array
            .array()?
            .iter()
            .enumerate()
            .map(|(i, value)| Json {
                value,
                path: format!("{}/{i}", array.path),
            })
            .collect())
    }

    fn array(&self) -> Checked<&'a [Value]> {
        match self.value {
            Value::Array(array) => Ok(array),
            _ => Err(self.fault("must be an array")),
        }
    }

    /// Element `index` of the array `list`, as `self` asks for it.
    pub fn element_of(&self, index: usize, owner: &Json<'a>, list: &str) -> Checked<Json<'a>> {
        let array = owner.get(list)?;
        let elements = match &array {
            Some(array) => array.array()?,
            None => &[],
        };
        let value = elements.get(index).ok_or_else(|| {
            self.fault(format_args!(
                "refers to {list} {index}, but the file has {}",
                elements.len()
            ))
        })?;
        Ok(Json {
            value,
            path: format!("{}/{list}/{index}", owner.path),
        })
    }

    /// What the index in member `key` refers to among `owner`'s array `list`.
    pub fn refer(
        &self,
        key: &str,
        owner: &Json<'a>,
        list: &str,
    ) -> Checked<Option<(usize, Json<'a>)>> {
        let Some(index) = self.get(key)? else {
            return Ok(None);
        };
        let i = index.as_index()?;
        Ok(Some((i, index.element_of(i, owner, list)?)))
    }

    /// This value as a non-negative integer.
    pub fn as_index(&self) -> Checked<usize> {
        self.value
            .as_u64()
            .and_then(|i| usize::try_from(i).ok())
            .ok_or_else(|| self.fault("must be a non-negative integer"))
    }

    pub fn as_number(&self) -> Checked<f64> {
        self.value
            .as_f64()
            .filter(|number| number.is_finite())
            .ok_or_else(|| self.fault("must be a number"))
    }

    pub fn as_text(&self) -> Checked<&'a str> {
        self.value
            .as_str()
            .ok_or_else(|| self.fault("must be a string"))
    }

    /// The non-negative integer `key`, or `default` where it is absent.
    pub fn index(&self, key: &str, default: usize) -> Checked<usize> {
        self.get(key)?.map_or(Ok(default), |json| json.as_index())
    }

    /// The number `key`, or `default` where it is absent. Finite.
    pub fn number(&self, key: &str, default: f64) -> Checked<f64> {
        self.get(key)?.map_or(Ok(default), |json| json.as_number())
    }

    /// The `N` numbers `key`, or `default` where they are absent. Finite.
    pub fn numbers<const N: usize>(&self, key: &str, default: [f64; N]) -> Checked<[f64; N]> {
        let Some(array) = self.get(key)? else {
            return Ok(default);
        };
        let numbers = array
            .array()?
            .iter()
            .map(|value| value.as_f64().filter(|number| number.is_finite()))
            .collect::<Option<Vec<f64>>>();
        numbers
            .and_then(|numbers| numbers.try_into().ok())
            .ok_or_else(|| array.fault(format_args!("must be an array of {N} numbers")))
    }

    /// The string `key`, where there is one.
    pub fn text(&self, key: &str) -> Checked<Option<&'a str>> {
        self.get(key)?.map(|json| json.as_text()).transpose()
    }

    /// The boolean `key`; false where it is absent.
    pub fn flag(&self, key: &str) -> Checked<bool> {
        match self.get(key)? {
            None => Ok(false),
            Some(json) => json
                .value
                .as_bool()
                .ok_or_else(|| json.fault("must be true or false")),
        }
    }

    /// Calls `found(extension name, path)` for every extension object in this value. The depth of
    /// the recursion is bounded by the JSON parser's (128).
    pub fn each_extension(&self, found: &mut impl FnMut(&str, &str)) {
        visit(self.value, &mut self.path.clone(), found);
    }
}

fn visit(value: &Value, path: &mut String, found: &mut impl FnMut(&str, &str)) {
    let end = path.len();
    match value {
        Value::Object(members) => {
            for (key, member) in members {
                // Extras are the application's own; what looks like an extension there is none.
                if key == "extras" {
                    continue;
                }
                path.push('/');
                path.push_str(key);
                if key == "extensions"
                    && let Value::Object(extensions) = member
                {
                    for name in extensions.keys() {
                        found(name, &format!("{path}/{name}"));
                    }
                }
                visit(member, path, found);
                path.truncate(end);
            }
        }
        Value::Array(elements) => {
            for (i, element) in elements.iter().enumerate() {
                if element.is_object() || element.is_array() {
                    path.push_str(&format!("/{i}"));
                    visit(element, path, found);
                    path.truncate(end);
                }
            }
        }
        _ => {}
    }
}
