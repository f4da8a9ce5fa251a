//! The animations of a glTF file, as far as they move cameras.

use super::data::Data;
use super::json::{AnimationPath, Channel, Node, Root, Spline};
use super::{local, parts_of};
use crate::scene::motion::{Between, CameraMotion, MovingNode, Track};
use crate::scene::{Lens, View};
use glam::DVec4;
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

/// The most nodes of cameras and above them that are looked at, over all cameras of a file with animations.
const MOST_NODES: usize = 1 << 16;

/// The most keys of all tracks.
const MOST_KEYS: u64 = 1 << 20;

/// What moves a node: the numbers of the animation and of its sampler for its translation, rotation and scale.
#[derive(Clone, Copy, Default)]
struct Moved {
    by: [Option<(usize, u32)>; 3],
    /// Whether several animations move the same of them.
    ambiguous: bool,
}

/// The animations of a file, and the tracks that have been read.
pub(super) struct Animations<'a> {
    root: &'a Root,
    /// What moves each node. Exporters often write an animation for each object, so that all animations play together;
    /// what several of them move is moved by the first.
    of_node: BTreeMap<u32, Moved>,
    /// The tracks, by the numbers of the animation and of its sampler, and by whether they are of rotations.
    tracks: HashMap<(usize, u32, bool), Result<Arc<Track>, String>>,
    /// How many more nodes may be looked at.
    left: usize,
    /// How many more keys may be read.
    keys_left: u64,
}

impl<'a> Animations<'a> {
    pub(super) fn new(root: &'a Root) -> Animations<'a> {
        let mut of_node: BTreeMap<u32, Moved> = BTreeMap::new();
        for (animation, channels) in root.animations.iter().map(|animation| &animation.channels).enumerate() {
            for channel in channels.iter() {
                let part = match channel.target.path {
                    AnimationPath::Translation => 0,
                    AnimationPath::Rotation => 1,
                    AnimationPath::Scale => 2,
                    AnimationPath::Pointer | AnimationPath::Other => continue,
                };
                let Some(node) = channel.target.node else { continue };
                let moved = of_node.entry(node).or_default();
                match moved.by[part] {
                    None => moved.by[part] = Some((animation, channel.sampler)),
                    Some((first, _)) => moved.ambiguous |= first != animation,
                }
            }
        }
        Animations { root, of_node, tracks: HashMap::new(), left: MOST_NODES, keys_left: MOST_KEYS }
    }

    /// Returns the first animation that changes more than the places of nodes.
    pub(super) fn of_pointer(&self) -> Option<usize> {
        let points = |channel: &Channel| channel.target.path == AnimationPath::Pointer;
        self.root.animations.iter().position(|animation| animation.channels.iter().any(points))
    }

    /// Returns the nodes that animations move.
    pub(super) fn moved(&self) -> impl Iterator<Item = u32> {
        self.of_node.keys().copied()
    }

    /// Returns the motion of a camera that has this view at rest, and whether several animations move the same of it.
    /// `nodes` are the numbers of its node and of those above it. `None` if nothing moves it.
    ///
    /// # Errors
    /// Why the animation cannot be read.
    pub(super) fn of_camera(
        &mut self,
        nodes: impl Iterator<Item = u32>,
        view: &View,
        data: &mut Data,
    ) -> Result<Option<(CameraMotion, bool)>, String> {
        if self.of_node.is_empty() {
            return Ok(None);
        }
        let mut nodes: Vec<u32> = nodes.take(self.left).collect();
        self.left -= nodes.len();
        if self.left == 0 {
            return Err("it hangs below too many nodes".into());
        }
        if !nodes.iter().any(|node| self.of_node.contains_key(node)) {
            return Ok(None);
        }
        nodes.reverse();
        let (mut times, mut ambiguous) = ([f64::INFINITY, f64::NEG_INFINITY], false);
        let mut chain = Vec::with_capacity(nodes.len());
        for number in nodes {
            let node = &self.root.nodes[number as usize];
            let mut moved = at_rest(node).ok_or_else(|| format!("node {number} has a matrix that is not affine"))?;
            if let Some(&Moved { by, ambiguous: several }) = self.of_node.get(&number) {
                if moved.parts.is_none() {
                    return Err(format!("node {number} has a matrix, whose parts cannot move"));
                }
                ambiguous |= several;
                let mut track = |part: usize| {
                    let Some((animation, sampler)) = by[part] else { return Ok(None) };
                    let track = self.track(animation, sampler, part == 1, data)?;
                    let [start, end] = track.ends();
                    times = [times[0].min(start), times[1].max(end)];
                    Ok::<_, String>(Some(track))
                };
                (moved.translation, moved.rotation, moved.scale) = (track(0)?, track(1)?, track(2)?);
            }
            chain.push(moved);
        }
        let lens = view.lens.unwrap_or(Lens::FovY(std::f64::consts::FRAC_PI_4));
        Ok(Some((CameraMotion { nodes: chain, lens, near: view.near, far: view.far, times }, ambiguous)))
    }

    /// Returns the track of a sampler.
    fn track(&mut self, animation: usize, sampler: u32, rotates: bool, data: &mut Data) -> Result<Arc<Track>, String> {
        if let Some(track) = self.tracks.get(&(animation, sampler, rotates)) {
            return track.clone();
        }
        let track = self.read(animation, sampler, rotates, data).map(Arc::new);
        let track = track.map_err(|what| format!("sampler {sampler} of animation {animation}: {what}"));
        self.tracks.insert((animation, sampler, rotates), track.clone());
        track
    }

    fn read(&mut self, animation: usize, sampler: u32, rotates: bool, data: &mut Data) -> Result<Track, String> {
        let sampler = self.root.animations[animation].samplers.get(sampler as usize).ok_or("it does not exist")?;
        let keys = data.accessor(sampler.input)?.count;
        self.keys_left =
            self.keys_left.checked_sub(keys).ok_or_else(|| format!("more than {MOST_KEYS} keys in all"))?;
        let times = data.scalars(sampler.input)?;
        let rising = times.windows(2).all(|pair| pair[0] < pair[1]);
        if times.is_empty() || !rising || !times.iter().all(|time| time.is_finite() && *time >= 0.0) {
            return Err("its times are not finite numbers from 0 on that rise".into());
        }
        let between = match sampler.interpolation {
            Spline::Step => Between::Step,
            Spline::Linear => Between::Linear,
            Spline::Cubic => Between::CubicSpline,
        };
        let count = times.len() * if between == Between::CubicSpline { 3 } else { 1 };
        let values: Vec<DVec4> = match rotates {
            true => data.quadruples(sampler.output, count)?,
            false => data.vectors(sampler.output, count)?.into_iter().map(|v| v.extend(0.0)).collect(),
        };
        if !values.iter().all(|value| value.is_finite()) {
            return Err("its values are not finite".into());
        }
        Ok(Track { times, values, between })
    }
}

/// Returns a node that nothing moves, or `None` if its transform is not affine.
fn at_rest(node: &Node) -> Option<MovingNode> {
    let parts = node.matrix.is_none().then(|| parts_of(node));
    Some(MovingNode { rest: local(node)?, parts, translation: None, rotation: None, scale: None })
}
