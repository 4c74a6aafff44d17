// Which light to ask from a place: down a tree, each time to a child in proportion to about how much light can come from it
// (Conty & Kulla 2018, section 5). So a dim lamp nearby is asked before a bright one far away.
// In: a place in world space, random bits. Out: a light and its probability.

// Irradiance [lx], roughly; within a group of lights no nearer than its radius.
float light_importance(LightNode n, vec3 position_w) {
    vec3 d = n.center_w - position_w;
    // Bounds that keep f32 finite.
    return clamp(n.intensity / max(max(dot(d, d), n.radius2), 1e-30) + n.irradiance, 1e-30, 1e30);
}

// Of the right one of two children.
float right_probability(World world, LightNode parent, vec3 position_w) {
    float left = light_importance(load_LightNode(world.light_tree, parent.child), position_w);
    float right = light_importance(load_LightNode(world.light_tree, parent.child + 1u), position_w);
    return right / (left + right);
}

uint choose_light_near(World world, vec3 position_w, uvec2 bits, out float probability) {
    LightNode n = load_LightNode(world.light_tree, 0u);
    float u = float(bits.x >> 8u) * 5.9604644775390625e-8;
    probability = 1.0;
    uint level = 0u;
    if (n.child != NONE) do {
        // A float of 24 bits is used up by then.
        if (level++ == 12u) u = float(bits.y >> 8u) * 5.9604644775390625e-8;
        float right = right_probability(world, n, position_w);
        bool goes_right = u < right;
        float chance = goes_right ? right : 1.0 - right;
        u = min((goes_right ? u : u - right) / chance, 0.99999994);
        probability *= chance;
        n = load_LightNode(world.light_tree, n.child + uint(goes_right));
    } while (n.child != NONE);
    return n.light;
}

// With which it chooses `light`.
float light_probability(World world, uint light, vec3 position_w) {
    LightNode n = load_LightNode(world.light_tree, 0u);
    uint trail = world.lights.at[light].trail;
    float probability = 1.0;
    if (n.child != NONE) do {
        float right = right_probability(world, n, position_w);
        probability *= (trail & 1u) != 0u ? right : 1.0 - right;
        n = load_LightNode(world.light_tree, n.child + (trail & 1u));
        trail >>= 1u;
    } while (n.child != NONE);
    return probability;
}
