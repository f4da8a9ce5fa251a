//! The animations of a glTF file, as far as they move cameras.

use super::data::Data;
use super::json::{AnimationPath, Node, Root, Spline};
use super::{local, parts_of};
use crate::scene::motion::{Between, CameraMotion, MovingNode, Track};
use crate::scene::{Lens, View};
use glam::DVec4;
use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

/// The most nodes of cameras and above them that are looked at, over all cameras of a file with animations.
const MOST_NODES: usize = 1 << 16;

/// The most keys of all tracks.
const MOST_KEYS: u64 = 1 << 20;

/// The animations of a file, and the tracks that have been read.
pub(super) struct Animations<'a> {
    root: &'a Root,
    /// The channels that move each node: the numbers of their animations, and theirs in these.
    of_node: HashMap<u32, Vec<(usize, usize)>>,
    /// The tracks, by the numbers of the animation and of its sampler.
    tracks: HashMap<(usize, u32), Result<Arc<Track>, String>>,
    /// How many more nodes may be looked at.
    left: usize,
    /// How many more keys may be read.
    keys_left: u64,
    /// The nodes that animations move and that no camera hangs on.
    others: BTreeSet<u32>,
}

impl<'a> Animations<'a> {
    pub(super) fn new(root: &'a Root) -> Animations<'a> {
        let mut of_node: HashMap<u32, Vec<(usize, usize)>> = HashMap::new();
        for (animation, channels) in root.animations.iter().map(|animation| &animation.channels).enumerate() {
            for (number, channel) in channels.iter().enumerate() {
                if let Some(node) = channel.target.node.filter(|_| channel.target.path != AnimationPath::Other) {
                    of_node.entry(node).or_default().push((animation, number));
                }
            }
        }
        let others = of_node.keys().copied().filter(|&node| (node as usize) < root.nodes.len()).collect();
        Animations { root, of_node, tracks: HashMap::new(), left: MOST_NODES, keys_left: MOST_KEYS, others }
    }

    /// Returns the nodes that animations move and that hold none of the cameras asked for so far.
    pub(super) fn others(&self) -> impl Iterator<Item = u32> {
        self.others.iter().copied()
    }

    /// Returns the motion of a camera that has this view at rest, by the first animation that moves it, and a notice if
    /// there are more. `nodes` are the numbers of its node and of those above it. `None` if nothing moves it.
    ///
    /// # Errors
    /// Why the animation cannot be read.
    pub(super) fn of_camera(
        &mut self,
        nodes: impl Iterator<Item = u32>,
        view: &View,
        data: &mut Data,
    ) -> Result<Option<(CameraMotion, Option<&'static str>)>, String> {
        if self.of_node.is_empty() {
            return Ok(None);
        }
        let mut nodes: Vec<u32> = nodes.take(self.left).collect();
        self.left -= nodes.len();
        if self.left == 0 {
            return Err("it hangs below too many nodes".into());
        }
        nodes.iter().for_each(|node| {
            self.others.remove(node);
        });
        nodes.reverse();
        let moving =
            || nodes.iter().filter_map(|node| self.of_node.get(node)).flatten().map(|&(animation, _)| animation);
        let (Some(first), Some(last)) = (moving().min(), moving().max()) else { return Ok(None) };
        let more = (last > first).then_some("several animations move it, and only the first is read");
        let mut times = [f64::INFINITY, f64::NEG_INFINITY];
        let mut chain = Vec::with_capacity(nodes.len());
        for number in nodes {
            let node = &self.root.nodes[number as usize];
            let mut moved = at_rest(node).ok_or_else(|| format!("node {number} has a matrix that is not affine"))?;
            let channels = self.of_node.get(&number).cloned().unwrap_or_default();
            for (_, channel) in channels.into_iter().filter(|&(animation, _)| animation == first) {
                let (sampler, path) = {
                    let channel = &self.root.animations[first].channels[channel];
                    (channel.sampler, channel.target.path)
                };
                if moved.parts.is_none() {
                    return Err(format!("node {number} has a matrix, whose parts cannot move"));
                }
                let track = self.track(first, sampler, path, data)?;
                let [start, end] = track.ends();
                times = [times[0].min(start), times[1].max(end)];
                match path {
                    AnimationPath::Translation => moved.translation = Some(track),
                    AnimationPath::Rotation => moved.rotation = Some(track),
                    AnimationPath::Scale => moved.scale = Some(track),
                    AnimationPath::Other => {}
                }
            }
            chain.push(moved);
        }
        let lens = view.lens.unwrap_or(Lens::FovY(std::f64::consts::FRAC_PI_4));
        Ok(Some((CameraMotion { nodes: chain, lens, near: view.near, far: view.far, times }, more)))
    }

    /// Returns the track of a sampler.
    fn track(
        &mut self,
        animation: usize,
        sampler: u32,
        path: AnimationPath,
        data: &mut Data,
    ) -> Result<Arc<Track>, String> {
        if let Some(track) = self.tracks.get(&(animation, sampler)) {
            return track.clone();
        }
        let track = self.read(animation, sampler, path, data).map(Arc::new);
        let track = track.map_err(|what| format!("sampler {sampler} of animation {animation}: {what}"));
        self.tracks.insert((animation, sampler), track.clone());
        track
    }

    fn read(&mut self, animation: usize, sampler: u32, path: AnimationPath, data: &mut Data) -> Result<Track, String> {
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
        let values: Vec<DVec4> = match path {
            AnimationPath::Rotation => data.quadruples(sampler.output, count)?,
            _ => data.vectors(sampler.output, count)?.into_iter().map(|v| v.extend(0.0)).collect(),
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
