// Light of the faces that are seen and lit: one sum per tile of 64x64 pixels of the view. Rust twin: Receiver::is_lit and
// flux in src/object/shadow/raster.rs, which says why the shadow test is as it is.
//
// group 0, binding 0: uniform, frame of the Sun (dynamic offset)
//          binding 1: uniform, frame of the view (dynamic offset)
//          binding 2: read-only storage, the faces
//          binding 3: read-only storage, glow w/(n.o) of each face, epoch after epoch
//          binding 4: r32uint, face map of the Sun
//          binding 5: r32uint, face map of the view
//          binding 6: storage, sums of the tiles, epoch after epoch

struct Frame {
    column: vec4<f32>,   // gradient [px/radius], origin [px]
    row: vec4<f32>,
    right: vec4<f32>,    // one pixel [radii]
    down: vec4<f32>,
    eye: vec4<f32>,
    counts: vec4<u32>,   // side [px], first glow, first sum, 0
};

struct Face {
    corners: array<vec4<f32>, 3>,
    plane: vec4<f32>,    // normal, n.x of the plane [radii]
};

@group(0) @binding(0) var<uniform> sun: Frame;
@group(0) @binding(1) var<uniform> view: Frame;
@group(0) @binding(2) var<storage, read> faces: array<Face>;
@group(0) @binding(3) var<storage, read> glows: array<f32>;
@group(0) @binding(4) var sun_map: texture_2d<u32>;
@group(0) @binding(5) var view_map: texture_2d<u32>;
@group(0) @binding(6) var<storage, read_write> sums: array<f32>;

// Gap below which two surfaces touch [radii].
const CONTACT: f32 = 1e-5;

var<workgroup> lanes: array<f32, 256>;

// The point x moved along the ray to the eye onto the plane n.x = offset.
fn onto(x: vec3<f32>, eye: vec3<f32>, normal: vec3<f32>, offset: f32) -> vec3<f32> {
    return x + eye * ((offset - dot(normal, x)) / dot(normal, eye));
}

fn light(at: vec2<u32>) -> f32 {
    let id = textureLoad(view_map, at, 0).x;
    if (id == 0u) { return 0.0; }
    let glow = glows[view.counts.y + id - 1u];
    if (glow <= 0.0) { return 0.0; }
    let plane = faces[id - 1u].plane;
    let from_middle = vec2<f32>(at) + 0.5 - vec2<f32>(view.column.w, view.row.w);
    let ray = view.right.xyz * from_middle.x + view.down.xyz * from_middle.y;
    let p = onto(ray, view.eye.xyz, plane.xyz, plane.w);
    let place = vec2<f32>(dot(sun.column.xyz, p), dot(sun.row.xyz, p)) + vec2<f32>(sun.column.w, sun.row.w);
    let pixel = clamp(floor(place), vec2<f32>(0.0), vec2<f32>(f32(sun.counts.x - 1u)));
    let other = textureLoad(sun_map, vec2<u32>(pixel), 0).x;
    if (other == 0u || other == id) { return glow; }
    let above = faces[other - 1u].plane;
    let shift = pixel + 0.5 - place;
    let q = p + onto(sun.right.xyz * shift.x + sun.down.xyz * shift.y, sun.eye.xyz, plane.xyz, 0.0);
    let up = sign(dot(above.xyz, sun.eye.xyz));
    let hides_p = (above.w - dot(above.xyz, p)) * up > CONTACT;
    let hides_q = (above.w - dot(above.xyz, q)) * up > CONTACT;
    return select(glow, 0.0, hides_p && hides_q);
}

@compute @workgroup_size(16, 16)
fn sum_tile(
    @builtin(workgroup_id) tile: vec3<u32>,
    @builtin(local_invocation_id) lane: vec3<u32>,
    @builtin(local_invocation_index) index: u32,
    @builtin(num_workgroups) tiles: vec3<u32>,
) {
    var sum = 0.0;
    for (var k = 0u; k < 16u; k++) {
        let at = tile.xy * 64u + lane.xy + 16u * vec2<u32>(k % 4u, k / 4u);
        if (all(at < vec2<u32>(view.counts.x))) { sum += light(at); }
    }
    lanes[index] = sum;
    workgroupBarrier();
    for (var reach = 128u; reach > 0u; reach /= 2u) {
        if (index < reach) { lanes[index] += lanes[index + reach]; }
        workgroupBarrier();
    }
    if (index == 0u) { sums[view.counts.z + tile.y * tiles.x + tile.x] = lanes[0]; }
}
