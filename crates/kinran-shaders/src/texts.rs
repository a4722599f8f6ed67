//! The texts. Written by ./x shaders.

/// WESL, the sources.
pub mod wesl {
    use crate::Module;

    /// How to include it.
    pub const README: &str = include_str!("../src/README.md");

    /// The module `beckmann`.
    pub const BECKMANN: &str = include_str!("../src/beckmann.wesl");

    /// The module `detail_hsv`.
    pub const DETAIL_HSV: &str = include_str!("../src/detail_hsv.wesl");

    /// The module `detail_normal`.
    pub const DETAIL_NORMAL: &str = include_str!("../src/detail_normal.wesl");

    /// The module `detail_over`.
    pub const DETAIL_OVER: &str = include_str!("../src/detail_over.wesl");

    /// The module `detail_overlay`.
    pub const DETAIL_OVERLAY: &str = include_str!("../src/detail_overlay.wesl");

    /// The module `frame`.
    pub const FRAME: &str = include_str!("../src/frame.wesl");

    /// The module `fuzz_p_s`.
    pub const FUZZ_P_S: &str = include_str!("../src/fuzz_p_s.wesl");

    /// The module `fuzz_phase`.
    pub const FUZZ_PHASE: &str = include_str!("../src/fuzz_phase.wesl");

    /// The module `fuzz_layer`.
    pub const FUZZ_LAYER: &str = include_str!("../src/fuzz_layer.wesl");

    /// The module `fuzz_ambient`.
    pub const FUZZ_AMBIENT: &str = include_str!("../src/fuzz_ambient.wesl");

    /// The module `fuzz_deferred`.
    pub const FUZZ_DEFERRED: &str = include_str!("../src/fuzz_deferred.wesl");

    /// The module `multiscatter`.
    pub const MULTISCATTER: &str = include_str!("../src/multiscatter.wesl");

    /// The module `sh`.
    pub const SH: &str = include_str!("../src/sh.wesl");

    /// The module `sym`.
    pub const SYM: &str = include_str!("../src/sym.wesl");

    /// The module `aniso`.
    pub const ANISO: &str = include_str!("../src/aniso.wesl");

    /// The module `detail_layer`.
    pub const DETAIL_LAYER: &str = include_str!("../src/detail_layer.wesl");

    /// The module `ggx`.
    pub const GGX: &str = include_str!("../src/ggx.wesl");

    /// The module `fuzz_sampling`.
    pub const FUZZ_SAMPLING: &str = include_str!("../src/fuzz_sampling.wesl");

    /// The module `sggx`.
    pub const SGGX: &str = include_str!("../src/sggx.wesl");

    /// The module `skin_curvature`.
    pub const SKIN_CURVATURE: &str = include_str!("../src/skin_curvature.wesl");

    /// The module `skin_lighting`.
    pub const SKIN_LIGHTING: &str = include_str!("../src/skin_lighting.wesl");

    /// The modules, each after those it needs.
    pub const MODULES: &[Module] = &[
        Module { name: "beckmann", text: BECKMANN, needs: &[] },
        Module { name: "detail_hsv", text: DETAIL_HSV, needs: &[] },
        Module { name: "detail_normal", text: DETAIL_NORMAL, needs: &[] },
        Module { name: "detail_over", text: DETAIL_OVER, needs: &[] },
        Module { name: "detail_overlay", text: DETAIL_OVERLAY, needs: &[] },
        Module { name: "frame", text: FRAME, needs: &[] },
        Module { name: "fuzz_p_s", text: FUZZ_P_S, needs: &[] },
        Module { name: "fuzz_phase", text: FUZZ_PHASE, needs: &[] },
        Module { name: "fuzz_layer", text: FUZZ_LAYER, needs: &["fuzz_phase"] },
        Module { name: "fuzz_ambient", text: FUZZ_AMBIENT, needs: &["fuzz_layer"] },
        Module { name: "fuzz_deferred", text: FUZZ_DEFERRED, needs: &["fuzz_layer"] },
        Module { name: "multiscatter", text: MULTISCATTER, needs: &[] },
        Module { name: "sh", text: SH, needs: &[] },
        Module { name: "sym", text: SYM, needs: &[] },
        Module { name: "aniso", text: ANISO, needs: &["frame", "sym"] },
        Module { name: "detail_layer", text: DETAIL_LAYER, needs: &["aniso"] },
        Module { name: "ggx", text: GGX, needs: &["sym"] },
        Module { name: "fuzz_sampling", text: FUZZ_SAMPLING, needs: &["fuzz_phase", "ggx"] },
        Module { name: "sggx", text: SGGX, needs: &["frame", "sym"] },
        Module { name: "skin_curvature", text: SKIN_CURVATURE, needs: &["sym"] },
        Module { name: "skin_lighting", text: SKIN_LIGHTING, needs: &["ggx", "sh"] },
    ];
}

/// WGSL.
pub mod wgsl {
    use crate::Module;

    /// How to include it.
    pub const README: &str = include_str!("../wgsl/README.md");

    /// The module `beckmann`.
    pub const BECKMANN: &str = include_str!("../wgsl/beckmann.wgsl");

    /// The module `detail_hsv`.
    pub const DETAIL_HSV: &str = include_str!("../wgsl/detail_hsv.wgsl");

    /// The module `detail_normal`.
    pub const DETAIL_NORMAL: &str = include_str!("../wgsl/detail_normal.wgsl");

    /// The module `detail_over`.
    pub const DETAIL_OVER: &str = include_str!("../wgsl/detail_over.wgsl");

    /// The module `detail_overlay`.
    pub const DETAIL_OVERLAY: &str = include_str!("../wgsl/detail_overlay.wgsl");

    /// The module `frame`.
    pub const FRAME: &str = include_str!("../wgsl/frame.wgsl");

    /// The module `fuzz_p_s`.
    pub const FUZZ_P_S: &str = include_str!("../wgsl/fuzz_p_s.wgsl");

    /// The module `fuzz_phase`.
    pub const FUZZ_PHASE: &str = include_str!("../wgsl/fuzz_phase.wgsl");

    /// The module `fuzz_layer`.
    pub const FUZZ_LAYER: &str = include_str!("../wgsl/fuzz_layer.wgsl");

    /// The module `fuzz_ambient`.
    pub const FUZZ_AMBIENT: &str = include_str!("../wgsl/fuzz_ambient.wgsl");

    /// The module `fuzz_deferred`.
    pub const FUZZ_DEFERRED: &str = include_str!("../wgsl/fuzz_deferred.wgsl");

    /// The module `multiscatter`.
    pub const MULTISCATTER: &str = include_str!("../wgsl/multiscatter.wgsl");

    /// The module `sh`.
    pub const SH: &str = include_str!("../wgsl/sh.wgsl");

    /// The module `sym`.
    pub const SYM: &str = include_str!("../wgsl/sym.wgsl");

    /// The module `aniso`.
    pub const ANISO: &str = include_str!("../wgsl/aniso.wgsl");

    /// The module `detail_layer`.
    pub const DETAIL_LAYER: &str = include_str!("../wgsl/detail_layer.wgsl");

    /// The module `ggx`.
    pub const GGX: &str = include_str!("../wgsl/ggx.wgsl");

    /// The module `fuzz_sampling`.
    pub const FUZZ_SAMPLING: &str = include_str!("../wgsl/fuzz_sampling.wgsl");

    /// The module `sggx`.
    pub const SGGX: &str = include_str!("../wgsl/sggx.wgsl");

    /// The module `skin_curvature`.
    pub const SKIN_CURVATURE: &str = include_str!("../wgsl/skin_curvature.wgsl");

    /// The module `skin_lighting`.
    pub const SKIN_LIGHTING: &str = include_str!("../wgsl/skin_lighting.wgsl");

    /// All modules in one text.
    pub const ALL: &str = include_str!("../wgsl/kinran.wgsl");

    /// The modules, each after those it needs.
    pub const MODULES: &[Module] = &[
        Module { name: "beckmann", text: BECKMANN, needs: &[] },
        Module { name: "detail_hsv", text: DETAIL_HSV, needs: &[] },
        Module { name: "detail_normal", text: DETAIL_NORMAL, needs: &[] },
        Module { name: "detail_over", text: DETAIL_OVER, needs: &[] },
        Module { name: "detail_overlay", text: DETAIL_OVERLAY, needs: &[] },
        Module { name: "frame", text: FRAME, needs: &[] },
        Module { name: "fuzz_p_s", text: FUZZ_P_S, needs: &[] },
        Module { name: "fuzz_phase", text: FUZZ_PHASE, needs: &[] },
        Module { name: "fuzz_layer", text: FUZZ_LAYER, needs: &["fuzz_phase"] },
        Module { name: "fuzz_ambient", text: FUZZ_AMBIENT, needs: &["fuzz_layer"] },
        Module { name: "fuzz_deferred", text: FUZZ_DEFERRED, needs: &["fuzz_layer"] },
        Module { name: "multiscatter", text: MULTISCATTER, needs: &[] },
        Module { name: "sh", text: SH, needs: &[] },
        Module { name: "sym", text: SYM, needs: &[] },
        Module { name: "aniso", text: ANISO, needs: &["frame", "sym"] },
        Module { name: "detail_layer", text: DETAIL_LAYER, needs: &["aniso"] },
        Module { name: "ggx", text: GGX, needs: &["sym"] },
        Module { name: "fuzz_sampling", text: FUZZ_SAMPLING, needs: &["fuzz_phase", "ggx"] },
        Module { name: "sggx", text: SGGX, needs: &["frame", "sym"] },
        Module { name: "skin_curvature", text: SKIN_CURVATURE, needs: &["sym"] },
        Module { name: "skin_lighting", text: SKIN_LIGHTING, needs: &["ggx", "sh"] },
    ];
}

/// GLSL 4.50.
pub mod glsl_450 {
    use crate::Module;

    /// How to include it.
    pub const README: &str = include_str!("../glsl_450/README.md");

    /// The module `beckmann`.
    pub const BECKMANN: &str = include_str!("../glsl_450/beckmann.glsl");

    /// The module `detail_hsv`.
    pub const DETAIL_HSV: &str = include_str!("../glsl_450/detail_hsv.glsl");

    /// The module `detail_normal`.
    pub const DETAIL_NORMAL: &str = include_str!("../glsl_450/detail_normal.glsl");

    /// The module `detail_over`.
    pub const DETAIL_OVER: &str = include_str!("../glsl_450/detail_over.glsl");

    /// The module `detail_overlay`.
    pub const DETAIL_OVERLAY: &str = include_str!("../glsl_450/detail_overlay.glsl");

    /// The module `frame`.
    pub const FRAME: &str = include_str!("../glsl_450/frame.glsl");

    /// The module `fuzz_p_s`.
    pub const FUZZ_P_S: &str = include_str!("../glsl_450/fuzz_p_s.glsl");

    /// The module `fuzz_phase`.
    pub const FUZZ_PHASE: &str = include_str!("../glsl_450/fuzz_phase.glsl");

    /// The module `fuzz_layer`.
    pub const FUZZ_LAYER: &str = include_str!("../glsl_450/fuzz_layer.glsl");

    /// The module `fuzz_ambient`.
    pub const FUZZ_AMBIENT: &str = include_str!("../glsl_450/fuzz_ambient.glsl");

    /// The module `fuzz_deferred`.
    pub const FUZZ_DEFERRED: &str = include_str!("../glsl_450/fuzz_deferred.glsl");

    /// The module `multiscatter`.
    pub const MULTISCATTER: &str = include_str!("../glsl_450/multiscatter.glsl");

    /// The module `sh`.
    pub const SH: &str = include_str!("../glsl_450/sh.glsl");

    /// The module `sym`.
    pub const SYM: &str = include_str!("../glsl_450/sym.glsl");

    /// The module `aniso`.
    pub const ANISO: &str = include_str!("../glsl_450/aniso.glsl");

    /// The module `detail_layer`.
    pub const DETAIL_LAYER: &str = include_str!("../glsl_450/detail_layer.glsl");

    /// The module `ggx`.
    pub const GGX: &str = include_str!("../glsl_450/ggx.glsl");

    /// The module `fuzz_sampling`.
    pub const FUZZ_SAMPLING: &str = include_str!("../glsl_450/fuzz_sampling.glsl");

    /// The module `sggx`.
    pub const SGGX: &str = include_str!("../glsl_450/sggx.glsl");

    /// The module `skin_curvature`.
    pub const SKIN_CURVATURE: &str = include_str!("../glsl_450/skin_curvature.glsl");

    /// The module `skin_lighting`.
    pub const SKIN_LIGHTING: &str = include_str!("../glsl_450/skin_lighting.glsl");

    /// All modules in one text.
    pub const ALL: &str = include_str!("../glsl_450/kinran.glsl");

    /// The modules, each after those it needs.
    pub const MODULES: &[Module] = &[
        Module { name: "beckmann", text: BECKMANN, needs: &[] },
        Module { name: "detail_hsv", text: DETAIL_HSV, needs: &[] },
        Module { name: "detail_normal", text: DETAIL_NORMAL, needs: &[] },
        Module { name: "detail_over", text: DETAIL_OVER, needs: &[] },
        Module { name: "detail_overlay", text: DETAIL_OVERLAY, needs: &[] },
        Module { name: "frame", text: FRAME, needs: &[] },
        Module { name: "fuzz_p_s", text: FUZZ_P_S, needs: &[] },
        Module { name: "fuzz_phase", text: FUZZ_PHASE, needs: &[] },
        Module { name: "fuzz_layer", text: FUZZ_LAYER, needs: &["fuzz_phase"] },
        Module { name: "fuzz_ambient", text: FUZZ_AMBIENT, needs: &["fuzz_layer"] },
        Module { name: "fuzz_deferred", text: FUZZ_DEFERRED, needs: &["fuzz_layer"] },
        Module { name: "multiscatter", text: MULTISCATTER, needs: &[] },
        Module { name: "sh", text: SH, needs: &[] },
        Module { name: "sym", text: SYM, needs: &[] },
        Module { name: "aniso", text: ANISO, needs: &["frame", "sym"] },
        Module { name: "detail_layer", text: DETAIL_LAYER, needs: &["aniso"] },
        Module { name: "ggx", text: GGX, needs: &["sym"] },
        Module { name: "fuzz_sampling", text: FUZZ_SAMPLING, needs: &["fuzz_phase", "ggx"] },
        Module { name: "sggx", text: SGGX, needs: &["frame", "sym"] },
        Module { name: "skin_curvature", text: SKIN_CURVATURE, needs: &["sym"] },
        Module { name: "skin_lighting", text: SKIN_LIGHTING, needs: &["ggx", "sh"] },
    ];
}

/// GLSL ES 3.00.
pub mod glsl_es_300 {
    use crate::Module;

    /// How to include it.
    pub const README: &str = include_str!("../glsl_es_300/README.md");

    /// The module `beckmann`.
    pub const BECKMANN: &str = include_str!("../glsl_es_300/beckmann.glsl");

    /// The module `detail_hsv`.
    pub const DETAIL_HSV: &str = include_str!("../glsl_es_300/detail_hsv.glsl");

    /// The module `detail_normal`.
    pub const DETAIL_NORMAL: &str = include_str!("../glsl_es_300/detail_normal.glsl");

    /// The module `detail_over`.
    pub const DETAIL_OVER: &str = include_str!("../glsl_es_300/detail_over.glsl");

    /// The module `detail_overlay`.
    pub const DETAIL_OVERLAY: &str = include_str!("../glsl_es_300/detail_overlay.glsl");

    /// The module `frame`.
    pub const FRAME: &str = include_str!("../glsl_es_300/frame.glsl");

    /// The module `fuzz_p_s`.
    pub const FUZZ_P_S: &str = include_str!("../glsl_es_300/fuzz_p_s.glsl");

    /// The module `fuzz_phase`.
    pub const FUZZ_PHASE: &str = include_str!("../glsl_es_300/fuzz_phase.glsl");

    /// The module `fuzz_layer`.
    pub const FUZZ_LAYER: &str = include_str!("../glsl_es_300/fuzz_layer.glsl");

    /// The module `fuzz_ambient`.
    pub const FUZZ_AMBIENT: &str = include_str!("../glsl_es_300/fuzz_ambient.glsl");

    /// The module `fuzz_deferred`.
    pub const FUZZ_DEFERRED: &str = include_str!("../glsl_es_300/fuzz_deferred.glsl");

    /// The module `multiscatter`.
    pub const MULTISCATTER: &str = include_str!("../glsl_es_300/multiscatter.glsl");

    /// The module `sh`.
    pub const SH: &str = include_str!("../glsl_es_300/sh.glsl");

    /// The module `sym`.
    pub const SYM: &str = include_str!("../glsl_es_300/sym.glsl");

    /// The module `aniso`.
    pub const ANISO: &str = include_str!("../glsl_es_300/aniso.glsl");

    /// The module `detail_layer`.
    pub const DETAIL_LAYER: &str = include_str!("../glsl_es_300/detail_layer.glsl");

    /// The module `ggx`.
    pub const GGX: &str = include_str!("../glsl_es_300/ggx.glsl");

    /// The module `fuzz_sampling`.
    pub const FUZZ_SAMPLING: &str = include_str!("../glsl_es_300/fuzz_sampling.glsl");

    /// The module `sggx`.
    pub const SGGX: &str = include_str!("../glsl_es_300/sggx.glsl");

    /// The module `skin_curvature`.
    pub const SKIN_CURVATURE: &str = include_str!("../glsl_es_300/skin_curvature.glsl");

    /// The module `skin_lighting`.
    pub const SKIN_LIGHTING: &str = include_str!("../glsl_es_300/skin_lighting.glsl");

    /// All modules in one text.
    pub const ALL: &str = include_str!("../glsl_es_300/kinran.glsl");

    /// The modules, each after those it needs.
    pub const MODULES: &[Module] = &[
        Module { name: "beckmann", text: BECKMANN, needs: &[] },
        Module { name: "detail_hsv", text: DETAIL_HSV, needs: &[] },
        Module { name: "detail_normal", text: DETAIL_NORMAL, needs: &[] },
        Module { name: "detail_over", text: DETAIL_OVER, needs: &[] },
        Module { name: "detail_overlay", text: DETAIL_OVERLAY, needs: &[] },
        Module { name: "frame", text: FRAME, needs: &[] },
        Module { name: "fuzz_p_s", text: FUZZ_P_S, needs: &[] },
        Module { name: "fuzz_phase", text: FUZZ_PHASE, needs: &[] },
        Module { name: "fuzz_layer", text: FUZZ_LAYER, needs: &["fuzz_phase"] },
        Module { name: "fuzz_ambient", text: FUZZ_AMBIENT, needs: &["fuzz_layer"] },
        Module { name: "fuzz_deferred", text: FUZZ_DEFERRED, needs: &["fuzz_layer"] },
        Module { name: "multiscatter", text: MULTISCATTER, needs: &[] },
        Module { name: "sh", text: SH, needs: &[] },
        Module { name: "sym", text: SYM, needs: &[] },
        Module { name: "aniso", text: ANISO, needs: &["frame", "sym"] },
        Module { name: "detail_layer", text: DETAIL_LAYER, needs: &["aniso"] },
        Module { name: "ggx", text: GGX, needs: &["sym"] },
        Module { name: "fuzz_sampling", text: FUZZ_SAMPLING, needs: &["fuzz_phase", "ggx"] },
        Module { name: "sggx", text: SGGX, needs: &["frame", "sym"] },
        Module { name: "skin_curvature", text: SKIN_CURVATURE, needs: &["sym"] },
        Module { name: "skin_lighting", text: SKIN_LIGHTING, needs: &["ggx", "sh"] },
    ];
}

/// HLSL.
pub mod hlsl {
    use crate::Module;

    /// How to include it.
    pub const README: &str = include_str!("../hlsl/README.md");

    /// The module `beckmann`.
    pub const BECKMANN: &str = include_str!("../hlsl/beckmann.hlsl");

    /// The module `detail_hsv`.
    pub const DETAIL_HSV: &str = include_str!("../hlsl/detail_hsv.hlsl");

    /// The module `detail_normal`.
    pub const DETAIL_NORMAL: &str = include_str!("../hlsl/detail_normal.hlsl");

    /// The module `detail_over`.
    pub const DETAIL_OVER: &str = include_str!("../hlsl/detail_over.hlsl");

    /// The module `detail_overlay`.
    pub const DETAIL_OVERLAY: &str = include_str!("../hlsl/detail_overlay.hlsl");

    /// The module `frame`.
    pub const FRAME: &str = include_str!("../hlsl/frame.hlsl");

    /// The module `fuzz_p_s`.
    pub const FUZZ_P_S: &str = include_str!("../hlsl/fuzz_p_s.hlsl");

    /// The module `fuzz_phase`.
    pub const FUZZ_PHASE: &str = include_str!("../hlsl/fuzz_phase.hlsl");

    /// The module `fuzz_layer`.
    pub const FUZZ_LAYER: &str = include_str!("../hlsl/fuzz_layer.hlsl");

    /// The module `fuzz_ambient`.
    pub const FUZZ_AMBIENT: &str = include_str!("../hlsl/fuzz_ambient.hlsl");

    /// The module `fuzz_deferred`.
    pub const FUZZ_DEFERRED: &str = include_str!("../hlsl/fuzz_deferred.hlsl");

    /// The module `multiscatter`.
    pub const MULTISCATTER: &str = include_str!("../hlsl/multiscatter.hlsl");

    /// The module `sh`.
    pub const SH: &str = include_str!("../hlsl/sh.hlsl");

    /// The module `sym`.
    pub const SYM: &str = include_str!("../hlsl/sym.hlsl");

    /// The module `aniso`.
    pub const ANISO: &str = include_str!("../hlsl/aniso.hlsl");

    /// The module `detail_layer`.
    pub const DETAIL_LAYER: &str = include_str!("../hlsl/detail_layer.hlsl");

    /// The module `ggx`.
    pub const GGX: &str = include_str!("../hlsl/ggx.hlsl");

    /// The module `fuzz_sampling`.
    pub const FUZZ_SAMPLING: &str = include_str!("../hlsl/fuzz_sampling.hlsl");

    /// The module `sggx`.
    pub const SGGX: &str = include_str!("../hlsl/sggx.hlsl");

    /// The module `skin_curvature`.
    pub const SKIN_CURVATURE: &str = include_str!("../hlsl/skin_curvature.hlsl");

    /// The module `skin_lighting`.
    pub const SKIN_LIGHTING: &str = include_str!("../hlsl/skin_lighting.hlsl");

    /// All modules in one text.
    pub const ALL: &str = include_str!("../hlsl/kinran.hlsl");

    /// The modules, each after those it needs.
    pub const MODULES: &[Module] = &[
        Module { name: "beckmann", text: BECKMANN, needs: &[] },
        Module { name: "detail_hsv", text: DETAIL_HSV, needs: &[] },
        Module { name: "detail_normal", text: DETAIL_NORMAL, needs: &[] },
        Module { name: "detail_over", text: DETAIL_OVER, needs: &[] },
        Module { name: "detail_overlay", text: DETAIL_OVERLAY, needs: &[] },
        Module { name: "frame", text: FRAME, needs: &[] },
        Module { name: "fuzz_p_s", text: FUZZ_P_S, needs: &[] },
        Module { name: "fuzz_phase", text: FUZZ_PHASE, needs: &[] },
        Module { name: "fuzz_layer", text: FUZZ_LAYER, needs: &["fuzz_phase"] },
        Module { name: "fuzz_ambient", text: FUZZ_AMBIENT, needs: &["fuzz_layer"] },
        Module { name: "fuzz_deferred", text: FUZZ_DEFERRED, needs: &["fuzz_layer"] },
        Module { name: "multiscatter", text: MULTISCATTER, needs: &[] },
        Module { name: "sh", text: SH, needs: &[] },
        Module { name: "sym", text: SYM, needs: &[] },
        Module { name: "aniso", text: ANISO, needs: &["frame", "sym"] },
        Module { name: "detail_layer", text: DETAIL_LAYER, needs: &["aniso"] },
        Module { name: "ggx", text: GGX, needs: &["sym"] },
        Module { name: "fuzz_sampling", text: FUZZ_SAMPLING, needs: &["fuzz_phase", "ggx"] },
        Module { name: "sggx", text: SGGX, needs: &["frame", "sym"] },
        Module { name: "skin_curvature", text: SKIN_CURVATURE, needs: &["sym"] },
        Module { name: "skin_lighting", text: SKIN_LIGHTING, needs: &["ggx", "sh"] },
    ];
}

/// MSL.
pub mod msl {
    use crate::Module;

    /// How to include it.
    pub const README: &str = include_str!("../msl/README.md");

    /// The module `beckmann`.
    pub const BECKMANN: &str = include_str!("../msl/beckmann.h");

    /// The module `detail_hsv`.
    pub const DETAIL_HSV: &str = include_str!("../msl/detail_hsv.h");

    /// The module `detail_normal`.
    pub const DETAIL_NORMAL: &str = include_str!("../msl/detail_normal.h");

    /// The module `detail_over`.
    pub const DETAIL_OVER: &str = include_str!("../msl/detail_over.h");

    /// The module `detail_overlay`.
    pub const DETAIL_OVERLAY: &str = include_str!("../msl/detail_overlay.h");

    /// The module `frame`.
    pub const FRAME: &str = include_str!("../msl/frame.h");

    /// The module `fuzz_p_s`.
    pub const FUZZ_P_S: &str = include_str!("../msl/fuzz_p_s.h");

    /// The module `fuzz_phase`.
    pub const FUZZ_PHASE: &str = include_str!("../msl/fuzz_phase.h");

    /// The module `fuzz_layer`.
    pub const FUZZ_LAYER: &str = include_str!("../msl/fuzz_layer.h");

    /// The module `fuzz_ambient`.
    pub const FUZZ_AMBIENT: &str = include_str!("../msl/fuzz_ambient.h");

    /// The module `fuzz_deferred`.
    pub const FUZZ_DEFERRED: &str = include_str!("../msl/fuzz_deferred.h");

    /// The module `multiscatter`.
    pub const MULTISCATTER: &str = include_str!("../msl/multiscatter.h");

    /// The module `sh`.
    pub const SH: &str = include_str!("../msl/sh.h");

    /// The module `sym`.
    pub const SYM: &str = include_str!("../msl/sym.h");

    /// The module `aniso`.
    pub const ANISO: &str = include_str!("../msl/aniso.h");

    /// The module `detail_layer`.
    pub const DETAIL_LAYER: &str = include_str!("../msl/detail_layer.h");

    /// The module `ggx`.
    pub const GGX: &str = include_str!("../msl/ggx.h");

    /// The module `fuzz_sampling`.
    pub const FUZZ_SAMPLING: &str = include_str!("../msl/fuzz_sampling.h");

    /// The module `sggx`.
    pub const SGGX: &str = include_str!("../msl/sggx.h");

    /// The module `skin_curvature`.
    pub const SKIN_CURVATURE: &str = include_str!("../msl/skin_curvature.h");

    /// The module `skin_lighting`.
    pub const SKIN_LIGHTING: &str = include_str!("../msl/skin_lighting.h");

    /// All modules in one text.
    pub const ALL: &str = include_str!("../msl/kinran.h");

    /// The modules, each after those it needs.
    pub const MODULES: &[Module] = &[
        Module { name: "beckmann", text: BECKMANN, needs: &[] },
        Module { name: "detail_hsv", text: DETAIL_HSV, needs: &[] },
        Module { name: "detail_normal", text: DETAIL_NORMAL, needs: &[] },
        Module { name: "detail_over", text: DETAIL_OVER, needs: &[] },
        Module { name: "detail_overlay", text: DETAIL_OVERLAY, needs: &[] },
        Module { name: "frame", text: FRAME, needs: &[] },
        Module { name: "fuzz_p_s", text: FUZZ_P_S, needs: &[] },
        Module { name: "fuzz_phase", text: FUZZ_PHASE, needs: &[] },
        Module { name: "fuzz_layer", text: FUZZ_LAYER, needs: &["fuzz_phase"] },
        Module { name: "fuzz_ambient", text: FUZZ_AMBIENT, needs: &["fuzz_layer"] },
        Module { name: "fuzz_deferred", text: FUZZ_DEFERRED, needs: &["fuzz_layer"] },
        Module { name: "multiscatter", text: MULTISCATTER, needs: &[] },
        Module { name: "sh", text: SH, needs: &[] },
        Module { name: "sym", text: SYM, needs: &[] },
        Module { name: "aniso", text: ANISO, needs: &["frame", "sym"] },
        Module { name: "detail_layer", text: DETAIL_LAYER, needs: &["aniso"] },
        Module { name: "ggx", text: GGX, needs: &["sym"] },
        Module { name: "fuzz_sampling", text: FUZZ_SAMPLING, needs: &["fuzz_phase", "ggx"] },
        Module { name: "sggx", text: SGGX, needs: &["frame", "sym"] },
        Module { name: "skin_curvature", text: SKIN_CURVATURE, needs: &["sym"] },
        Module { name: "skin_lighting", text: SKIN_LIGHTING, needs: &["ggx", "sh"] },
    ];
}
