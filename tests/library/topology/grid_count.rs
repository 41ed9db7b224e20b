//! The isosurface of one isovalue counted from the grid: components and Euler characteristic.
//!
//! The isosurface is cut by the grid into points on lattice edges (+1 each), open arcs on faces
//! (-1) and open patches in cells: +1 per loop, -2 per tunnel, which joins two loops. The Euler
//! characteristic with compact support is additive over these pieces. Written for clarity, slow.

use std::collections::BTreeMap;

use isospectrum::unstable::topology::exact::ExactField;

/// A union-find over lattice edges, which are numbered 3 * lower vertex + axis.
#[derive(Default)]
struct Components {
    parent: BTreeMap<u32, u32>,
}

impl Components {
    fn find(&mut self, edge: u32) -> u32 {
        let mut root = edge;
        while let Some(&p) = self.parent.get(&root) {
            if p == root {
                break;
            }
            root = p;
        }
        self.parent.insert(edge, root);
        root
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        self.parent.insert(a, b);
    }
}

/// One component of the isosurface as the grid counts it.
pub(crate) struct Counted {
    /// Its Euler characteristic.
    pub(crate) euler: i64,
    /// Every lattice edge it crosses: the end not above the isovalue, the end above.
    pub(crate) edges: Vec<[u32; 2]>,
}

/// The isosurface of one isovalue key, counted from the grid.
pub(crate) struct Count<'a> {
    field: &'a ExactField<'a>,
    key: i128,
    components: Components,
    /// Contributions to the Euler characteristic: a crossed edge, and how much.
    euler: Vec<(u32, i64)>,
    crossed: Vec<(u32, [u32; 2])>,
}

impl<'a> Count<'a> {
    /// Counts the isosurface at an isovalue, component by component.
    pub(crate) fn of(field: &'a ExactField<'a>, isovalue: f64) -> Vec<Counted> {
        let mut count = Count {
            field,
            key: field.isovalue_key(isovalue),
            components: Components::default(),
            euler: Vec::new(),
            crossed: Vec::new(),
        };
        let dims = field.dims();
        for v in 0..field.n_vertices() as u32 {
            let p = field.position(v).map(|p| (p + 1) as usize);
            for axis in 0..3 {
                if p[axis] + 1 < dims[axis] {
                    count.visit_edge(v, axis);
                }
                let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
                if p[i] + 1 < dims[i] && p[j] + 1 < dims[j] {
                    let arcs = count.face_arcs(v, axis);
                    count.euler.extend(arcs.into_iter().map(|[edge, _]| (edge, -1)));
                }
            }
            if (0..3).all(|a| p[a] + 1 < dims[a]) {
                count.visit_cell(v);
            }
        }
        count.collect()
    }

    fn is_above(&self, v: u32) -> bool {
        self.field.key(v) > self.key
    }

    fn visit_edge(&mut self, v: u32, axis: usize) {
        let w = v + self.field.strides()[axis];
        let ends = match (self.is_above(v), self.is_above(w)) {
            (false, true) => [v, w],
            (true, false) => [w, v],
            _ => return,
        };
        let edge = 3 * v + axis as u32;
        self.crossed.push((edge, ends));
        self.euler.push((edge, 1));
    }

    /// The edge between two neighbouring vertices.
    fn edge(&self, a: u32, b: u32) -> u32 {
        let axis = self.field.strides().iter().position(|&s| s == a.abs_diff(b));
        3 * a.min(b) + axis.expect("neighbours") as u32
    }

    /// The curves of the isosurface on a face, each as the two edges it joins.
    fn face_arcs(&self, corner: u32, axis: usize) -> Vec<[u32; 2]> {
        let strides = self.field.strides();
        let (si, sj) = (strides[(axis + 1) % 3], strides[(axis + 2) % 3]);
        let ring = [corner, corner + si, corner + si + sj, corner + sj];
        let crossings: Vec<u32> = (0..4)
            .filter(|&n| self.is_above(ring[n]) != self.is_above(ring[(n + 1) % 4]))
            .map(|n| self.edge(ring[n], ring[(n + 1) % 4]))
            .collect();
        match crossings.len() {
            0 => Vec::new(),
            2 => vec![[crossings[0], crossings[1]]],
            _ => {
                // Above the saddle's value the high corners are cut off, else the low ones.
                let saddle = self.field.face_saddle(corner, axis).expect("an ambiguous face");
                let cut_off_is_above = !saddle.is_above(self.key);
                (0..4)
                    .filter(|&n| self.is_above(ring[n]) == cut_off_is_above)
                    .map(|n| {
                        [
                            self.edge(ring[(n + 3) % 4], ring[n]),
                            self.edge(ring[n], ring[(n + 1) % 4]),
                        ]
                    })
                    .collect()
            }
        }
    }

    fn visit_cell(&mut self, corner: u32) {
        let strides = self.field.strides();
        let mut loops = Components::default();
        for (axis, stride) in strides.into_iter().enumerate() {
            for face in [corner, corner + stride] {
                for [a, b] in self.face_arcs(face, axis) {
                    loops.join(a, b);
                    self.components.join(a, b);
                }
            }
        }
        let edges: Vec<u32> = loops.parent.keys().copied().collect();
        let mut roots: Vec<u32> = edges.iter().map(|&e| loops.find(e)).collect();
        roots.sort_unstable();
        roots.dedup();
        self.euler.extend(roots.iter().map(|&edge| (edge, 1)));
        self.visit_tunnel(corner, &edges, &mut loops);
    }

    /// Joins the two loops of a tunnel, if the cell has one.
    fn visit_tunnel(&mut self, corner: u32, edges: &[u32], loops: &mut Components) {
        let side = self.corner_components(corner);
        let offsets = self.field.cell_offsets();
        let n_sides = [false, true].map(|above| {
            let mut roots: Vec<usize> = (0..8)
                .filter(|&c| self.is_above(corner + offsets[c]) == above)
                .map(|c| side[c])
                .collect();
            roots.sort_unstable();
            roots.dedup();
            roots.len()
        });
        for saddle in self.field.body_saddles(corner) {
            let above = saddle.is_above(self.key);
            let is_tunnel = if saddle.index == 1 {
                !above && n_sides[0] >= 2
            } else {
                above && n_sides[1] >= 2
            };
            if !is_tunnel {
                continue;
            }
            // The loops that border the same component of the other side.
            let other_side_is_above = saddle.index == 1;
            let mut loops_of: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
            for &edge in edges {
                let (v, axis) = (edge / 3, (edge % 3) as usize);
                let w = v + self.field.strides()[axis];
                let end = if self.is_above(v) == other_side_is_above { v } else { w };
                let c = offsets.iter().position(|&o| corner + o == end).expect("a corner");
                loops_of.entry(side[c]).or_default().push(loops.find(edge));
            }
            let mut n_pairs = 0;
            for roots in loops_of.values_mut() {
                roots.sort_unstable();
                roots.dedup();
                if roots.len() == 2 {
                    n_pairs += 1;
                    self.components.join(roots[0], roots[1]);
                    self.euler.push((roots[0], -2));
                }
            }
            assert_eq!(n_pairs, 1, "a tunnel has exactly one pair of loops");
        }
    }

    /// Components of a cell's corners over its edges and decided faces.
    fn corner_components(&self, corner: u32) -> [usize; 8] {
        let offsets = self.field.cell_offsets();
        let mut side: [usize; 8] = std::array::from_fn(|c| c);
        let mut join = |a: usize, b: usize| {
            let (from, to) = (side[a], side[b]);
            side.iter_mut().filter(|s| **s == from).for_each(|s| *s = to);
        };
        for a in 0..8usize {
            for bit in [1, 2, 4] {
                let b = a ^ bit;
                if self.is_above(corner + offsets[a]) == self.is_above(corner + offsets[b]) {
                    join(a, b);
                }
            }
        }
        for axis in 0..3 {
            for upper in [0, 1 << axis] {
                let Some(saddle) = self.field.face_saddle(corner + offsets[upper], axis) else {
                    continue;
                };
                let place =
                    |v: u32| offsets.iter().position(|&o| corner + o == v).expect("a corner");
                let diagonal = if saddle.is_above(self.key) { saddle.high } else { saddle.low };
                let [a, b] = diagonal.map(place);
                if self.is_above(diagonal[0]) == self.is_above(diagonal[1]) {
                    join(a, b);
                }
            }
        }
        side
    }

    fn collect(mut self) -> Vec<Counted> {
        let mut counted: BTreeMap<u32, Counted> = BTreeMap::new();
        for (edge, ends) in std::mem::take(&mut self.crossed) {
            let root = self.components.find(edge);
            counted.entry(root).or_insert(Counted { euler: 0, edges: Vec::new() }).edges.push(ends);
        }
        for (edge, change) in std::mem::take(&mut self.euler) {
            let root = self.components.find(edge);
            counted.get_mut(&root).expect("a crossed edge").euler += change;
        }
        counted.into_values().collect()
    }
}
