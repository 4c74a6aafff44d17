// glTF's metallic-roughness BSDF (glTF 2.0 appendix B) with KHR_materials_ior, _specular,
// _transmission and _volume, as three lobes: diffuse, microfacet reflection, transmission.
// Directions point away from the surface; values exclude the cosine; pdfs are per solid angle.
// One visible microfacet normal (Heitz 2018; spherical caps, Dupuy & Benyoub 2023) is drawn for each
// event, and one lobe is chosen given it: an estimator of the whole BSDF as long as every lobe that
// can contribute has a chance. No roughness is special: alpha = 0 makes the microfacet the surface.

const uint LOBE_NONE = 0u;
const uint LOBE_DIFFUSE = 1u;
const uint LOBE_REFLECTION = 2u;
const uint LOBE_TRANSMISSION = 3u;

struct Surface {
    vec3 position_w;
    // Both on the side of wo.
    vec3 normal_g;
    vec3 normal_s;
    vec3 wo;
    // wo is on the front.
    bool front;
    vec3 base_color;
    float metallic;
    float transmission;
    float alpha;
    vec3 f0;
    float f90;
    float ior;
    bool solid;
    vec3 absorption;
    // Leaves the front face only [nit].
    vec3 emission;
    // Probability that a ray meets it: alpha of a blended surface.
    float coverage;
    // To the next surface's origin [m] along the face normal: beyond the rounding of position_w.
    float offset;
};

struct BsdfSample {
    uint lobe;
    vec3 wi;
    // f cos / pdf; for the diffuse lobe without the colour and Fresnel factors, see diffuse_weight.
    vec3 weight;
    // Of having chosen the lobe.
    float probability;
};

vec3 diffuse_color(Surface s) { return s.base_color * ((1.0 - s.metallic) * (1.0 - s.transmission)); }

vec3 schlick(vec3 f0, vec3 f90, float cos_theta) {
    float m = clamp(1.0 - cos_theta, 0.0, 1.0);
    float m2 = m * m;
    return f0 + (f90 - f0) * (m2 * m2 * m);
}

// (η cos θ_t)² by Snell's law, below 0 where reflection is total. Not by way of 1 - sin², which has no digits left at
// grazing angles, nor where η is nearly 1.
float refracted2(float cos_i, float eta) { return (eta - 1.0) * (eta + 1.0) + cos_i * cos_i; }

// Unpolarised reflectance between indices 1 (side of cos_i) and eta.
float fresnel_dielectric(float cos_i, float eta) {
    float k = refracted2(cos_i, eta);
    if (k <= 0.0) return 1.0;
    float eta_cos_t = sqrt(k), eta2_cos_i = eta * eta * cos_i;
    float rs = (cos_i - eta_cos_t) / (cos_i + eta_cos_t);
    float rp = (eta2_cos_i - eta_cos_t) / (eta2_cos_i + eta_cos_t);
    return 0.5 * (rs * rs + rp * rp);
}

// Index on the far side over that on the side of wo.
float relative_ior(Surface s) { return s.front ? s.ior : 1.0 / s.ior; }

// Of the dielectric layer. Exact where light can pass through the surface, since total internal
// reflection needs it; glTF's Schlick elsewhere.
vec3 fresnel_layer(Surface s, float cos_theta) {
    if (!HAS_TRANSMISSION || s.transmission == 0.0) return schlick(s.f0, vec3(s.f90), cos_theta);
    float eta = s.solid ? relative_ior(s) : s.ior;
    float f = fresnel_dielectric(cos_theta, eta);
    float r0 = square((eta - 1.0) / (eta + 1.0));
    // KHR_materials_specular scales F0 and F90: keep the shape, move the ends.
    float shape = r0 < 1.0 ? clamp((f - r0) / (1.0 - r0), 0.0, 1.0) : 1.0;
    vec3 layer = mix(s.f0, vec3(s.f90), shape);
    return f >= 1.0 ? vec3(1.0) : layer;
}

// Of all reflection: the dielectric layer where it is not metal.
vec3 fresnel_reflection(Surface s, vec3 layer, float cos_theta) {
    return s.metallic == 0.0 ? layer : mix(layer, schlick(s.base_color, vec3(1.0), cos_theta), s.metallic);
}

// What the layer leaves for the diffuse lobe at this pair of directions (glTF appendix B, fresnel_mix).
float diffuse_transmittance(vec3 f0, float f90, vec3 wo, vec3 wi) {
    if (!HAS_SPECULAR || f90 == 0.0) return 1.0;
    // Of wo or wi to the half vector: half the angle between them.
    float cosine = sqrt(max(0.5 + 0.5 * dot(wo, wi), 0.0));
    return 1.0 - max_component(schlick(f0, vec3(f90), cosine));
}

// Visible normals by spherical caps (Dupuy & Benyoub 2023); wo in the frame of the normal.
vec3 sample_visible_normal(vec3 wo, float alpha, vec2 u) {
    vec3 v = normalize(vec3(alpha * wo.xy, wo.z));
    float phi = 2.0 * PI * u.x;
    float z = (1.0 - u.y) * (1.0 + v.z) - v.z;
    float r = sqrt(clamp(1.0 - z * z, 0.0, 1.0));
    vec3 h = vec3(r * cos(phi), r * sin(phi), z) + v;
    h = vec3(alpha * h.xy, max(h.z, 0.0));
    float l = length(h);
    return l > 0.0 ? h / l : vec3(0.0, 0.0, 1.0);
}

// Smith's Λ for GGX (Heitz 2014).
float smith_lambda(float cos_theta, float alpha) {
    float c2 = max(cos_theta * cos_theta, 1e-16);
    return 0.5 * (sqrt(1.0 + alpha * alpha * max(0.0, 1.0 - c2) / c2) - 1.0);
}
// G2 / G1(wo): the weight that visible normals leave (height-correlated, same side).
float smith_g2_over_g1(float cos_o, float cos_i, float alpha) {
    float lo = smith_lambda(cos_o, alpha), li = smith_lambda(cos_i, alpha);
    return (1.0 + lo) / (1.0 + lo + li);
}

vec3 refract_about(vec3 wo, vec3 h, float eta) {
    float c = dot(wo, h);
    return normalize(h * (c - sqrt(max(refracted2(c, eta), 0.0))) - wo);
}

// The lobes given the cosine between wo and the microfacet, and in what proportion they are chosen:
// diffuse, reflection, transmission.
struct Lobes {
    vec3 reflectance;
    vec3 transmittance;
    vec3 choice;
};

Lobes lobes_at(Surface s, float cos_h) {
    vec3 layer = HAS_SPECULAR ? fresnel_layer(s, cos_h) : vec3(0.0);
    Lobes l;
    l.reflectance = HAS_SPECULAR ? fresnel_reflection(s, layer, cos_h) : vec3(0.0);
    l.transmittance = HAS_TRANSMISSION ? s.base_color * ((1.0 - s.metallic) * s.transmission * (1.0 - max_component(layer))) : vec3(0.0);
    // The floor keeps the weight of the diffuse lobe bounded where the layer reflects nearly all
    // towards the eye but not between the eye and a photon.
    float diffuse = average(diffuse_color(s)) * max(1.0 - max_component(layer), 0.25);
    l.choice = vec3(diffuse, average(l.reflectance), average(l.transmittance));
    return l;
}

// Draws an event. `radiance`: the path carries radiance (from the eye) rather than flux, which
// refraction scales by (η_i/η_t)². u.xy: microfacet, u.z: lobe; v.xy: diffuse direction.
BsdfSample sample_bsdf(Surface s, bool radiance, vec4 u, vec2 v) {
    BsdfSample result = BsdfSample(LOBE_NONE, vec3(0.0), vec3(0.0), 1.0);
    float cos_o = dot(s.normal_s, s.wo);
    vec3 normal_diffuse = s.normal_s;
    // The shading normal can point away from the eye that sees the face: treat as grazing. Not the
    // diffuse lobe, whose value does not depend on wo: photons find it about their own normal.
    if (cos_o <= 0.0) {
        s.normal_s = s.normal_g;
        cos_o = dot(s.normal_g, s.wo);
    }
    mat3 frame = frame_of(s.normal_s);
    vec3 h = s.normal_s;
    if (HAS_ROUGH && s.alpha > 0.0) h = frame * sample_visible_normal(s.wo * frame, s.alpha, u.xy);
    float cos_h = clamp(dot(s.wo, h), 0.0, 1.0);
    Lobes lobes = lobes_at(s, cos_h);
    float w_sum = lobes.choice.x + lobes.choice.y + lobes.choice.z;
    if (!(w_sum > 0.0)) return result;
    float choice = u.z * w_sum;

    if (choice < lobes.choice.x) {
        result.lobe = LOBE_DIFFUSE;
        result.probability = lobes.choice.x / w_sum;
        result.wi = frame_of(normal_diffuse) * sample_cosine(v);
        result.weight = diffuse_color(s) * (diffuse_transmittance(s.f0, s.f90, s.wo, result.wi) / result.probability);
        if (dot(result.wi, s.normal_g) <= 0.0) result.weight = vec3(0.0);
    } else if (choice < lobes.choice.x + lobes.choice.y) {
        result.lobe = LOBE_REFLECTION;
        result.probability = lobes.choice.y / w_sum;
        result.wi = normalize(2.0 * dot(s.wo, h) * h - s.wo);
        float cos_i = dot(s.normal_s, result.wi);
        bool above = cos_i > 0.0 && dot(result.wi, s.normal_g) > 0.0;
        result.weight = above ? lobes.reflectance * (smith_g2_over_g1(cos_o, cos_i, s.alpha) / result.probability) : vec3(0.0);
    } else {
        result.lobe = LOBE_TRANSMISSION;
        result.probability = lobes.choice.z / w_sum;
        float eta = s.solid ? relative_ior(s) : 1.0;
        // Thin walls: the reflected direction, mirrored to the far side.
        if (s.solid) result.wi = refract_about(s.wo, h, eta);
        else {
            vec3 reflected = normalize(2.0 * dot(s.wo, h) * h - s.wo);
            result.wi = reflected - 2.0 * dot(reflected, s.normal_s) * s.normal_s;
        }
        float cos_i = -dot(s.normal_s, result.wi);
        bool below = cos_i > 0.0 && dot(result.wi, s.normal_g) < 0.0;
        float scale = radiance ? 1.0 / (eta * eta) : 1.0;
        float g1 = 1.0 / (1.0 + smith_lambda(cos_i, s.alpha));
        result.weight = below ? lobes.transmittance * (scale * g1 / result.probability) : vec3(0.0);
    }
    return result;
}

// The diffuse lobe towards wi, and about the density (solid angle) with which sample_bsdf draws wi from
// it, the choice of the lobe included: that choice depends on the microfacet, which is taken to lie in
// the surface. Exact where there is one microfacet, and good enough to weigh two strategies by.
vec3 eval_diffuse(Surface s, vec3 wi, out float pdf_solid_angle) {
    pdf_solid_angle = 0.0;
    float cos_i = dot(s.normal_s, wi);
    if (cos_i <= 0.0 || dot(s.normal_g, wi) <= 0.0) return vec3(0.0);
    vec3 choice = lobes_at(s, clamp(dot(s.normal_s, s.wo), 0.0, 1.0)).choice;
    pdf_solid_angle = cos_i / PI * (choice.x / max(choice.x + choice.y + choice.z, 1e-30));
    return diffuse_color(s) * (diffuse_transmittance(s.f0, s.f90, s.wo, wi) / PI);
}

// Both specular lobes towards wi, and the density (solid angle) with which sample_bsdf draws wi from
// them, the choice of the lobe included. Zero where the surface is smooth.
vec3 eval_specular(Surface s, vec3 wi, out float pdf_solid_angle) {
    float cos_o = dot(s.normal_s, s.wo), cos_i = dot(s.normal_s, wi);
    bool crosses = cos_i < 0.0;
    pdf_solid_angle = 0.0;
    if (s.alpha <= 0.0 || cos_o <= 0.0 || cos_i == 0.0 || crosses != (dot(s.normal_g, wi) < 0.0)) return vec3(0.0);
    if (crosses && (!HAS_TRANSMISSION || s.transmission == 0.0)) return vec3(0.0);
    float eta = crosses && s.solid ? relative_ior(s) : 1.0;
    // Walter et al. 2007, eq. 16; a thin wall mirrors wi to the side of wo.
    vec3 h = s.wo + wi * eta;
    if (crosses && !s.solid) h -= 2.0 * cos_i * s.normal_s;
    float n_h = dot(s.normal_s, h);
    // No microfacet refracts one into the other.
    if (dot(h, h) == 0.0) return vec3(0.0);
    h = normalize(n_h < 0.0 ? -h : h);
    n_h = dot(s.normal_s, h);
    float o_h = dot(s.wo, h), i_h = dot(wi, h);
    if (o_h <= 0.0) return vec3(0.0);
    // 1 - (n·h)² by the cross product: no cancellation near the peak.
    vec3 sine = cross(s.normal_s, h);
    float a2 = s.alpha * s.alpha;
    float d = a2 / (PI * square(dot(sine, sine) + a2 * n_h * n_h));
    float lo = smith_lambda(cos_o, s.alpha), li = smith_lambda(abs(cos_i), s.alpha);
    Lobes lobes = lobes_at(s, o_h);
    vec3 choice = lobes.choice / (lobes.choice.x + lobes.choice.y + lobes.choice.z);
    // Visible normals have density G1 D (wo·h) / cos_o, and reflection 1 / (4 wo·h).
    pdf_solid_angle = (crosses ? choice.z : choice.y) * d / ((1.0 + lo) * 4.0 * cos_o);
    if (!crosses) return lobes.reflectance * (d / ((1.0 + lo + li) * 4.0 * cos_o * cos_i));
    float g = d / ((1.0 + lo) * (1.0 + li));
    if (!s.solid) return lobes.transmittance * (g / (4.0 * cos_o * -cos_i));
    // Walter et al. 2007, eqs. 17 and 21; the radiance scale 1/η² cancels the square of η.
    float jacobian = o_h * -i_h / square(eta * i_h + o_h);
    pdf_solid_angle *= 4.0 * eta * eta * jacobian;
    if (i_h < 0.0) return lobes.transmittance * (g * jacobian / (cos_o * -cos_i));
    pdf_solid_angle = 0.0;
    return vec3(0.0);
}
