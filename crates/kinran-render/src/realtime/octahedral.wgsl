// Unit vectors in one word.
//
// Cigolle et al. A Survey of Efficient Representations for Independent Unit Vectors. JCGT 2014.
fn octahedral_encode(n: vec3f) -> u32 {
    let p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    let folded = (1.0 - abs(p.yx)) * select(vec2f(-1.0), vec2f(1.0), p >= vec2f(0.0));
    return pack2x16snorm(select(folded, p, n.z >= 0.0));
}

fn octahedral_decode(word: u32) -> vec3f {
    let p = unpack2x16snorm(word);
    let z = 1.0 - abs(p.x) - abs(p.y);
    let folded = (1.0 - abs(p.yx)) * select(vec2f(-1.0), vec2f(1.0), p >= vec2f(0.0));
    return normalize(vec3f(select(folded, p, z >= 0.0), z));
}
