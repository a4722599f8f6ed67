//! Fuzz in the reference renderer, against the formulas and the furnace.

use glam::{Vec3, vec3};
use kinran_image::untold;
use kinran_render::Error;
use kinran_render::reference::{Background, RenderScene, Settings, look_at, render};
use kinran_scene::{Environment, Fuzz, FuzzAttenuation, FuzzLayer, FuzzPhase, Scene};
use kinran_shading::fuzz::{
    fibre_direction, fibre_p_s, fuzz_alpha, fuzz_attenuation, fuzz_brdf, fuzz_deferred, fuzz_deferred_color,
    fuzz_deferred_escape, fuzz_passage,
};

#[allow(dead_code, reason = "tests share it")]
mod shapes;
use shapes::{directional, material, scene, square};

fn lit(fuzz: Option<Fuzz>, environment: Option<Environment>, light: Option<Vec3>) -> RenderScene {
    // Black for the specular lobe's albedo of a rough dielectric is not to be had; a grey base will do.
    let mut m = material(Vec3::splat(0.5), 0.0, 1.0);
    m.fuzz = fuzz;
    let mut s: Scene = scene(vec![square(0)], vec![m]);
    s.lights.extend(light.map(|direction| directional(-direction, 1.0)));
    RenderScene::new(&s, vec![None], environment).unwrap()
}

fn seen_along(scene: &RenderScene, v: Vec3, samples: u32) -> Vec3 {
    let up = if v.y.abs() > 0.9 { Vec3::Z } else { Vec3::Y };
    let settings = Settings {
        width: 1,
        height: 1,
        samples_per_pixel: samples,
        env_samples: 4,
        background: Background::Color(Vec3::ZERO),
        ..Settings::default()
    };
    let film = render(scene, &look_at(v * 3.0, Vec3::ZERO, up, 1e-4), &settings, &untold).unwrap();
    film.pixels[0].into()
}

#[test]
fn a_light_on_a_layer_is_what_the_formulas_say() {
    let layer = FuzzLayer {
        density: 0.3,
        spread: 0.2,
        tilt: 0.6,
        azimuth: 1.0,
        color: vec3(0.9, 0.5, 0.1),
        ..FuzzLayer::default()
    };
    let t = fibre_direction(layer.tilt, layer.azimuth);
    let alpha = fuzz_alpha(layer.spread);
    for (u, v) in [(vec3(0.3, 0.2, 0.8), vec3(-0.4, 0.5, 0.6)), (vec3(-0.9, 0.1, 0.3), vec3(0.1, 0.8, 0.4))] {
        let (u, v) = (u.normalize(), v.normalize());
        let plain = seen_along(&lit(None, None, Some(u)), v, 1);
        let lobe = layer.color * (fuzz_brdf(u, v, t, layer.density, alpha) * u.z);
        let passage = |w: Vec3| fuzz_passage(layer.density, w.z);
        let down = fibre_p_s(u.z, t.dot(u), t.z, alpha);
        for (attenuation, left) in [
            (FuzzAttenuation::None, Vec3::ONE),
            (FuzzAttenuation::Unscattered, fuzz_attenuation(passage(u), passage(v), 0.0, layer.color)),
            (FuzzAttenuation::Full, fuzz_attenuation(passage(u), passage(v), down, layer.color)),
        ] {
            let fuzz = Fuzz::Layer(FuzzLayer { attenuation, ..layer.clone() });
            let got = seen_along(&lit(Some(fuzz), None, Some(u)), v, 1);
            let wanted = plain * left + lobe;
            assert!(
                ((got - wanted) / wanted).abs().max_element() < 1e-3,
                "{attenuation:?}: wanted {wanted}, got {got}"
            );
        }

        let simple = Fuzz::Simple { fuzziness: 1.0, texture: None };
        let got = seen_along(&lit(Some(simple), None, Some(u)), v, 1).x;
        let half = Fuzz::Simple { fuzziness: 0.5, texture: None };
        let between = seen_along(&lit(Some(half), None, Some(u)), v, 1).x;
        assert!((between - 0.5 * (got + plain.x)).abs() < 1e-4, "lerp: {plain}, {between}, {got}");
        // The base's diffuse albedo is a little less than 0.5: the specular lobe takes its part first.
        let soft = fuzz_deferred(u.z, v.z, u.dot(v), fuzz_deferred_escape(v.z));
        let most = fuzz_deferred_color(Vec3::splat(0.5), v.z).x * soft;
        assert!(got > 0.85 * most && got < 1.15 * most + 0.02, "simple: {got} of {most}");
    }
}

/// Integral over the lights above the horizon by the midpoint rule, `rows` of equal height.
fn integral(rows: usize, columns: usize, mut f: impl FnMut(Vec3) -> f64) -> f64 {
    let mut sum = 0.0;
    for row in 0..rows {
        let z = (row as f32 + 0.5) / rows as f32;
        for column in 0..columns {
            let (sin, cos) = (std::f32::consts::TAU * (column as f32 + 0.5) / columns as f32).sin_cos();
            let r = (1.0 - z * z).sqrt();
            sum += f(vec3(r * cos, r * sin, z));
        }
    }
    sum * std::f64::consts::TAU / (rows * columns) as f64
}

#[test]
fn a_layer_returns_what_quadrature_says_and_no_more_than_the_furnace_brings() {
    let white = || Environment::from_fn(16, |_| Vec3::ONE);
    let views = [Vec3::Z, vec3(0.8, 0.0, 0.6), vec3(0.0, 0.98, 0.2).normalize()];
    // What the bare base reflects of lights, one by one, for the second integral.
    const ROWS: usize = 12;
    const COLUMNS: usize = 24;
    let bare = views.map(|v| {
        let mut reflected = Vec::new();
        integral(ROWS, COLUMNS, |u| {
            reflected.push(f64::from(seen_along(&lit(None, None, Some(u)), v, 1).x));
            0.0
        });
        reflected
    });
    for (density, spread, tilt) in [(0.05, 0.2, 0.0), (0.2, 0.2, 0.4), (0.5, 0.01, 1.57), (2.0, 1.0, 0.8)] {
        let layer = FuzzLayer { density, spread, tilt, ..FuzzLayer::default() };
        let (t, alpha) = (fibre_direction(tilt, 0.0), fuzz_alpha(spread));
        for (v, bare) in views.into_iter().zip(&bare) {
            let lobe = integral(256, 512, |u| f64::from(fuzz_brdf(u, v, t, density, alpha) * u.z));
            let mut reflected = bare.iter();
            let under = integral(ROWS, COLUMNS, |u| {
                let passage = |w: Vec3| fuzz_passage(density, w.z);
                let down = fibre_p_s(u.z, t.dot(u), t.z, alpha);
                let left = fuzz_attenuation(passage(u), passage(v), down, Vec3::ONE);
                reflected.next().unwrap() * f64::from(left.x)
            });
            let scene = lit(Some(Fuzz::Layer(layer.clone())), Some(white()), None);
            let (got, wanted) = (f64::from(seen_along(&scene, v, 512).x), lobe + under);
            // 2048 samples whose weights lie between 0 and some 2 times their mean: a standard error of 1.5 %; the sum over
            // few lights is within 0.5 %.
            assert!(
                (got / wanted - 1.0).abs() < 0.05 && got < 1.0,
                "density {density}, spread {spread}, tilt {tilt}, view {v}: wanted {wanted}, got {got}"
            );
        }
    }
    // Nothing on it is nothing.
    let none = FuzzLayer { density: 0.0, ..FuzzLayer::default() };
    let (bare, with) = (lit(None, Some(white()), None), lit(Some(Fuzz::Layer(none)), Some(white()), None));
    assert_eq!(seen_along(&bare, Vec3::Z, 16), seen_along(&with, Vec3::Z, 16));
}

#[test]
fn velvet_without_coefficients_is_an_error_that_names_the_material() {
    let layer = FuzzLayer { phase: FuzzPhase::Velvet, ..FuzzLayer::default() };
    let scene = lit(Some(Fuzz::Layer(layer)), None, Some(Vec3::Z));
    let result = render(&scene, &look_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 0.5), &Settings::default(), &untold);
    assert!(matches!(&result, Err(Error::Scene(e)) if e.contains("material 0")), "{:?}", result.err());
}
