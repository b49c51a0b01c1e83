//! What is wrong with a surface as the boundary of a medium. In flow positions and triangles, out flow counts
//! and the first place of each fault.
//!
//! Vertices are welded by exact position first: files split vertices where normals or texture coordinates differ.

use std::collections::{BTreeMap, HashMap};

use glam::DVec3;

use super::Bounds;
use super::containment::winding_number;
use super::mesh::{FaultSites, MeshFaults, area_vector};

/// How many triangles may be visited to find out which shell holds which; beyond that bounding boxes decide.
const WINDING_BUDGET: usize = 10_000_000;

/// How many pairs of a shell turned inwards and one turned outwards may be compared; beyond that, a fraction of a
/// second, all that are turned inwards count as inside out.
const MOST_PAIRS: usize = 100_000_000;

/// A welded, connected piece of a surface.
pub struct Shell {
    /// By welded vertices.
    pub triangles: Vec<[u32; 3]>,
    /// Where in the mesh they come from.
    pub numbers: Vec<u32>,
    /// The box around them.
    pub bounds: Bounds,
    closed: bool,
    /// Below 0 where the outside is inside.
    pub volume: f64,
}

/// What is known of a surface beyond its faults.
pub struct Topology {
    /// Triangles of inverted shells, by their numbers.
    pub inverted: Vec<u32>,
    /// Whether two of its bodies may overlap: their bounding boxes do.
    pub overlaps: bool,
    /// Where the faults are.
    pub sites: FaultSites,
    /// The area of its holes, over its own.
    pub holes: f64,
    /// The vertices of its open edges, welded.
    pub rims: Vec<u32>,
}

/// Adds open, non-manifold and inconsistent edges and inverted shells to `faults`.
pub fn analyse(positions: &[[f32; 3]], triangles: &[[u32; 3]], faults: &mut MeshFaults) -> Topology {
    let mut sites = FaultSites::default();
    let mut open = Vec::new();
    let shells = pieces(positions, triangles, faults, &mut sites, &mut open);
    let inverted = inverted_shells(&shells, positions);
    faults.inverted_shells = inverted.len();
    sites.inverted_shell = inverted.first().map(|shell| place(positions, shell.triangles[0][0]));
    Topology {
        overlaps: overlaps(&shells, &inverted),
        sites,
        holes: holes(positions, triangles, &open),
        rims: open.into_flattened(),
        inverted: inverted.into_iter().flat_map(|shell| shell.numbers.iter().copied()).collect(),
    }
}

/// The area of the holes of a surface, over its own.
pub fn share_of_holes(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> f64 {
    let mut open = Vec::new();
    pieces(positions, triangles, &mut MeshFaults::default(), &mut FaultSites::default(), &mut open);
    holes(positions, triangles, &open)
}

/// The pieces of a surface.
pub fn shells_of(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Vec<Shell> {
    pieces(positions, triangles, &mut MeshFaults::default(), &mut FaultSites::default(), &mut Vec::new())
}

fn pieces(
    positions: &[[f32; 3]],
    triangles: &[[u32; 3]],
    faults: &mut MeshFaults,
    sites: &mut FaultSites,
    open: &mut Vec<[u32; 2]>,
) -> Vec<Shell> {
    let welded = weld(positions);
    // A triangle that welding folds up has edges that cancel out.
    let (numbers, triangles): (Vec<u32>, Vec<[u32; 3]>) = (0..)
        .zip(triangles)
        .map(|(number, triangle)| (number, triangle.map(|vertex| welded[vertex as usize])))
        .filter(|(_, [a, b, c])| a != b && b != c && c != a)
        .unzip();
    let faulty = faulty_edges(positions, &triangles, faults, sites, open);
    shells(positions, &numbers, triangles, &faulty)
}

/// Whether the boxes of two shells meet that both are bodies and no cavities; yes where they are too many to tell.
fn overlaps(shells: &[Shell], inverted: &[&Shell]) -> bool {
    let is_body = |shell: &&Shell| (shell.volume > 0.0) != inverted.iter().any(|other| std::ptr::eq(*other, *shell));
    let bodies: Vec<_> = shells.iter().filter(is_body).collect();
    bodies.len() * bodies.len() > MOST_PAIRS
        || bodies.iter().enumerate().any(|(i, a)| bodies[i + 1..].iter().any(|b| a.bounds.intersects(&b.bounds)))
}

/// For each vertex the first one, in the order of their bits, at the same place.
pub fn weld(positions: &[[f32; 3]]) -> Vec<u32> {
    // Adding zero turns -0 into +0, which is the same place.
    let bits = |vertex: u32| positions[vertex as usize].map(|coordinate| (coordinate + 0.0).to_bits());
    let mut order: Vec<([u32; 3], u32)> = (0..positions.len() as u32).map(|vertex| (bits(vertex), vertex)).collect();
    order.sort_unstable();
    let mut welded = vec![0; positions.len()];
    let mut first = ([0; 3], u32::MAX);
    for (place, vertex) in order {
        if first.1 == u32::MAX || place != first.0 {
            first = (place, vertex);
        }
        welded[vertex as usize] = first.1;
    }
    welded
}

/// The area of the holes of a surface, over its own: what plane sheets over them would have, or as much as is left of those that
/// bend. `open` are the edges of one triangle only, along it.
fn holes(positions: &[[f32; 3]], triangles: &[[u32; 3]], open: &[[u32; 2]]) -> f64 {
    if open.is_empty() {
        return 0.0;
    }
    // Edges that hang together go around one hole, or around several that touch.
    let mut parent: HashMap<u32, u32> = open.iter().flatten().map(|&vertex| (vertex, vertex)).collect();
    fn root(parent: &mut HashMap<u32, u32>, mut vertex: u32) -> u32 {
        while let Some(&above) = parent.get(&vertex).filter(|&&above| above != vertex) {
            let next = parent.get(&above).copied().unwrap_or(above);
            parent.insert(vertex, next);
            vertex = next;
        }
        vertex
    }
    for &[from, to] in open {
        let (one, other) = (root(&mut parent, from), root(&mut parent, to));
        parent.insert(one.max(other), one.min(other));
    }
    // Summed up in one order.
    let mut rims: BTreeMap<u32, DVec3> = BTreeMap::new();
    for &[from, to] in open {
        let rim = root(&mut parent, from);
        let origin = place(positions, rim);
        let part = (place(positions, from) - origin).cross(place(positions, to) - origin);
        *rims.entry(rim).or_insert(DVec3::ZERO) += part;
    }
    let whole: f64 = triangles.iter().map(|&triangle| area_vector(positions, triangle).length()).sum();
    rims.values().map(|rim| rim.length()).sum::<f64>() / whole.max(f64::MIN_POSITIVE)
}

/// Counts the edges that do not join two triangles of one orientation and returns a vertex of each unbalanced one; puts those of one
/// triangle only behind `open`.
fn faulty_edges(
    positions: &[[f32; 3]],
    triangles: &[[u32; 3]],
    faults: &mut MeshFaults,
    sites: &mut FaultSites,
    open: &mut Vec<[u32; 2]>,
) -> Vec<u32> {
    // One word an edge: the lower vertex, the higher one (no file that is read has 2^31), the direction.
    let mut edges = Vec::with_capacity(triangles.len() * 3);
    for &[a, b, c] in triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let (low, high, backward) = if from < to { (from, to, 0) } else { (to, from, 1) };
            edges.push(u64::from(low) << 32 | u64::from(high) << 1 | backward);
        }
    }
    edges.sort_unstable();
    let mut faulty = Vec::new();
    for same in edges.chunk_by(|a, b| a >> 1 == b >> 1) {
        let backward = same.iter().filter(|&edge| edge & 1 == 1).count();
        let balanced = backward * 2 == same.len();
        let [low, high] = [same[0] >> 32, (same[0] & 0xffff_ffff) >> 1].map(|vertex| vertex as u32);
        let middle = || (place(positions, low) + place(positions, high)) * 0.5;
        if same.len() == 1 {
            faults.open_edges += 1;
            open.push(if backward == 0 { [low, high] } else { [high, low] });
            sites.open_edge.get_or_insert_with(middle);
        } else if !balanced {
            faults.inconsistent_edges += 1;
            sites.inconsistent_edge.get_or_insert_with(middle);
        }
        if same.len() > 2 {
            faults.non_manifold_edges += 1;
            sites.non_manifold_edge.get_or_insert_with(middle);
        }
        if !balanced {
            faulty.push(low);
        }
    }
    faulty
}

fn shells(positions: &[[f32; 3]], numbers: &[u32], triangles: Vec<[u32; 3]>, faulty: &[u32]) -> Vec<Shell> {
    let mut parent: Vec<u32> = (0..positions.len() as u32).collect();
    fn root(parent: &mut [u32], mut vertex: u32) -> u32 {
        while parent[vertex as usize] != vertex {
            let grandparent = parent[parent[vertex as usize] as usize];
            parent[vertex as usize] = grandparent;
            vertex = grandparent;
        }
        vertex
    }
    for &[a, b, c] in &triangles {
        for other in [b, c] {
            let (one, other) = (root(&mut parent, a), root(&mut parent, other));
            parent[one.max(other) as usize] = one.min(other);
        }
    }
    let mut number = vec![u32::MAX; positions.len()];
    let mut shells: Vec<Shell> = Vec::new();
    for (triangle, &origin) in triangles.into_iter().zip(numbers) {
        let root = root(&mut parent, triangle[0]) as usize;
        if number[root] == u32::MAX {
            number[root] = shells.len() as u32;
            shells.push(Shell {
                triangles: Vec::new(),
                numbers: Vec::new(),
                bounds: Bounds::EMPTY,
                closed: true,
                volume: 0.0,
            });
        }
        let shell = &mut shells[number[root] as usize];
        shell.triangles.push(triangle);
        shell.numbers.push(origin);
    }
    for &vertex in faulty {
        let root = root(&mut parent, vertex) as usize;
        shells[number[root] as usize].closed = false;
    }
    for shell in &mut shells {
        let corners = shell.triangles.iter().flatten().map(|&vertex| place(positions, vertex));
        shell.bounds = Bounds::around(corners);
        let origin = shell.bounds.center();
        let six_volumes = shell.triangles.iter().map(|triangle| {
            let [a, b, c] = triangle.map(|vertex| place(positions, vertex) - origin);
            a.dot(b.cross(c))
        });
        shell.volume = six_volumes.sum::<f64>() / 6.0;
    }
    shells
}

/// Closed shells whose inside lies outside: all of them where their volumes add up to less than nothing, else those of
/// negative volume that are no cavity of a shell around them.
fn inverted_shells<'a>(shells: &'a [Shell], positions: &[[f32; 3]]) -> Vec<&'a Shell> {
    let flat = |shell: &Shell| -1e-9 * shell.bounds.extent().max_element().powi(3);
    let inside_out: Vec<_> = shells.iter().filter(|shell| shell.closed && shell.volume < flat(shell)).collect();
    let closed = || shells.iter().filter(|shell| shell.closed);
    if !inside_out.is_empty() && closed().map(|shell| shell.volume).sum::<f64>() < 0.0 {
        return closed().collect();
    }
    let solids: Vec<_> = shells.iter().filter(|shell| shell.closed && shell.volume > 0.0).collect();
    if inside_out.len() * solids.len() > MOST_PAIRS {
        return inside_out;
    }
    let mut budget = WINDING_BUDGET;
    let mut is_cavity = |shell: &Shell| {
        let point = place(positions, shell.triangles[0][0]);
        let around = solids.iter().filter(|solid| solid.bounds.contains(point));
        let winding = around.map(|solid| {
            budget = budget.saturating_sub(solid.triangles.len());
            if budget > 0 { winding_number(positions, &solid.triangles, point) } else { 1.0 }
        });
        winding.sum::<f64>() > 0.5
    };
    inside_out.into_iter().filter(|shell| !is_cavity(shell)).collect()
}

/// Where a vertex is.
pub fn place(positions: &[[f32; 3]], vertex: u32) -> DVec3 {
    let [x, y, z] = positions[vertex as usize];
    DVec3::new(x.into(), y.into(), z.into())
}
