//! Fitting the view to surfaces.

use super::scene::Scene;
use crate::error::Result;
use crate::render::View;

impl Scene {
    /// Fits the view to all shown surfaces, unless they are empty.
    pub(super) fn fit(&mut self, view: &mut View) -> Result<()> {
        self.read_chunks()?;
        let mut boxes = Vec::new();
        for pinned in &self.pinned {
            let isovalue = pinned.surface().isovalue;
            boxes.extend(self.painter.bounds(&self.spectrum, isovalue, &view.keep)?);
        }
        let mesh = self.painter.mesh_at(&self.spectrum, self.isovalue)?;
        boxes.extend(mesh.with_shown(&view.keep, &view.picked).bounds());
        let around = boxes.into_iter().reduce(|[low, high], [a, b]| {
            [std::array::from_fn(|i| low[i].min(a[i])), std::array::from_fn(|i| high[i].max(b[i]))]
        });
        if let Some(bounds) = around {
            view.fit(self.spectrum.volume(), bounds);
        }
        Ok(())
    }

    /// Fits the view to the surfaces of all isovalues; of a large file, which is not loaded as a whole, to the volume.
    pub(super) fn fit_all(&self, view: &mut View) {
        let (spectrum, volume) = (&self.spectrum, self.spectrum.volume());
        let cell = volume.placement.cell_size();
        let mut bounds = [[0.0; 3], std::array::from_fn(|i| (volume.dims[i] - 1) as f64 * cell[i])];
        let uncapped = spectrum.triangles().iter().filter(|t| !t.cap).flat_map(|t| t.vertices);
        let knots = uncapped.flat_map(|v| spectrum.trajectory(v)).map(|k| k.position);
        let surfaces = knots.map(|p| p.map(f64::from)).fold(None, |around, p| {
            let [low, high]: [[f64; 3]; 2] = around.unwrap_or([p, p]);
            let corner =
                |f: fn(f64, f64) -> f64, q: [f64; 3]| std::array::from_fn(|i| f(p[i], q[i]));
            Some([corner(f64::min, low), corner(f64::max, high)])
        });
        if let Some(surfaces) = surfaces.filter(|_| self.file().is_none()) {
            bounds = surfaces;
        }
        view.fit(volume, bounds);
    }
}
