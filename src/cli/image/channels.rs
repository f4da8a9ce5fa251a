//! Which channels of a picture are meant: those that a flag names, or those that follow from the usual names.

use hbao::Error;
use hbao::image::Layers;
use std::path::Path;

/// The names that the components of colours and of vectors have in files.
const TRIPLES: [[&str; 3]; 3] = [["R", "G", "B"], ["X", "Y", "Z"], ["x", "y", "z"]];

/// A layer: what stands before the last point in the names of channels, and nothing in the others.
fn layer(name: &str) -> &str {
    name.rsplit_once('.').map_or("", |(layer, _)| layer)
}

/// What stands after the last point.
fn last(name: &str) -> &str {
    name.rsplit('.').next().unwrap_or(name)
}

/// Returns the name of a channel of this layer.
fn in_layer(layer: &str, name: &str) -> String {
    if layer.is_empty() { name.into() } else { format!("{layer}.{name}") }
}

/// The channels of a file that choices are made from.
pub(super) struct Names<'a> {
    path: &'a Path,
    names: Vec<&'a str>,
}

impl<'a> Names<'a> {
    pub(super) fn of(path: &'a Path, picture: &'a Layers) -> Names<'a> {
        Names { path, names: picture.names().collect() }
    }

    /// Returns the error that `what` is wrong, followed by the channels that the file has and the flag to give.
    fn refuse<T>(&self, what: &str, flag: &str) -> Result<T, Error> {
        const MOST: usize = 20;
        let mut listed = self.names.iter().take(MOST).copied().collect::<Vec<_>>().join(", ");
        if self.names.len() > MOST {
            listed += &format!(" and {} more", self.names.len() - MOST);
        }
        Err(Error::Input { path: self.path.into(), what: format!("{what}: give --{flag}, of the channels {listed}") })
    }

    /// Returns the index of the only channel of this name.
    fn named(&self, name: &str) -> Option<usize> {
        let mut found = (0..self.names.len()).filter(|&i| self.names[i] == name);
        found.next().filter(|_| found.next().is_none())
    }

    /// Returns whether a channel is the third component of a vector, and no depth.
    fn is_of_a_vector(&self, name: &str) -> bool {
        ["X", "Y"].iter().all(|other| self.names.contains(&&*in_layer(layer(name), other)))
    }

    /// Returns the channel of depth: the one with the name `given`, the only one, or the only one that is called `Z`
    /// and is not a vector's; first without a layer, then in any layer. Otherwise it is the channel `Y`.
    pub(super) fn depth(&self, given: Option<&str>) -> Result<usize, Error> {
        const FLAG: &str = "depth-channel NAME";
        if let Some(given) = given {
            return match self.named(given) {
                Some(found) => Ok(found),
                None if self.names.contains(&given) => {
                    self.refuse(&format!("several channels are called {given}"), FLAG)
                }
                None => self.refuse(&format!("it has no channel {given}"), FLAG),
            };
        }
        if self.names.len() == 1 {
            return Ok(0);
        }
        let is_depth = |i: &usize| last(self.names[*i]) == "Z" && !self.is_of_a_vector(self.names[*i]);
        let depths: Vec<usize> = (0..self.names.len()).filter(is_depth).collect();
        match (self.named("Z").filter(is_depth), depths.as_slice(), self.named("Y")) {
            (Some(only), ..) | (None, &[only], _) => Ok(only),
            (None, [], Some(y)) if !self.names.contains(&"X") => Ok(y),
            (None, [], _) => self.refuse("none of its channels is called Z or Y, and there are several", FLAG),
            (None, ..) => self.refuse("several of its channels are called Z", FLAG),
        }
    }

    /// Returns the three channels of a picture's vectors or colours: those that `given` names, as a layer or as three
    /// names; those of the only layer that has three; or those of the only layer among them with one of the names
    /// `usual`. `flag` is the flag that gives them.
    pub(super) fn triple(&self, given: Option<&str>, usual: &[&str], flag: &str) -> Result<[usize; 3], Error> {
        let found = |names: [&str; 3]| -> Option<[usize; 3]> {
            let [a, b, c] = names.map(|name| self.named(name));
            Some([a?, b?, c?])
        };
        let of_layer = |layer: &str| -> Vec<[usize; 3]> {
            let names = TRIPLES.map(|triple| triple.map(|name| in_layer(layer, name)));
            names.iter().filter_map(|triple| found(triple.each_ref().map(String::as_str))).collect()
        };
        if let Some(given) = given {
            let names: Vec<&str> = given.split(',').map(str::trim).collect();
            let triple = match names.as_slice() {
                [layer] => of_layer(layer).first().copied(),
                &[a, b, c] => found([a, b, c]),
                _ => None,
            };
            let wanted = format!("it has no three channels {given}");
            return triple.map_or_else(|| self.refuse(&wanted, flag), Ok);
        }
        let mut layers: Vec<&str> = self.names.iter().map(|name| layer(name)).collect();
        layers.dedup();
        layers.sort_unstable();
        layers.dedup();
        let all: Vec<(&str, [usize; 3])> =
            layers.iter().flat_map(|layer| of_layer(layer).into_iter().map(move |triple| (*layer, triple))).collect();
        let is_usual = |layer: &str| usual.iter().any(|name| last(layer).eq_ignore_ascii_case(name));
        let usual: Vec<_> = all.iter().filter(|(layer, _)| is_usual(layer)).collect();
        match (all.as_slice(), usual.as_slice()) {
            ([(_, only)], _) | (_, [(_, only)]) => Ok(*only),
            ([], _) => self.refuse("it has no three channels R, G, B or X, Y, Z", flag),
            _ => self.refuse("several of its layers have three channels", flag),
        }
    }

    /// Returns the channels of a picture's colours. Those of a grey one are three times the same.
    pub(super) fn colours(&self, given: Option<&str>) -> Result<[usize; 3], Error> {
        match self.named("Y").filter(|_| given.is_none() && !self.names.contains(&"X")) {
            Some(grey) if !self.names.contains(&"R") => Ok([grey; 3]),
            _ => self.triple(given, &["", "Combined", "rgba", "beauty"], "color-channels LAYER"),
        }
    }
}
