// Face map: the nearest face in each pixel, seen from one direction. Rust twin: FaceMap::draw in src/object/shadow/raster.rs;
// the numbers come from src/object/shadow/frame.rs.
//
// group 0, binding 0: uniform, the frame (dynamic offset)
//          binding 1: read-only storage, the faces
// target 0: r32uint, face + 1, or 0 for none; depth: depth32float, 0 near and 1 far

struct Frame {
    column: vec4<f32>,   // gradient [px/radius], origin [px]
    row: vec4<f32>,
    right: vec4<f32>,    // one pixel [radii]
    down: vec4<f32>,
    eye: vec4<f32>,
    counts: vec4<u32>,   // side [px], first glow, first sum, 0
};

struct Face {
    // [radii]; w: how far the face is drawn below its plane [radii], 1 for a sheet, nothing
    corners: array<vec4<f32>, 3>,
    plane: vec4<f32>,    // normal, n.x of the plane [radii]
};

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> faces: array<Face>;

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat) id: u32,
};

@vertex
fn corner(@builtin(vertex_index) index: u32) -> Corner {
    let id = index / 3u;
    let towards = dot(faces[id].plane.xyz, frame.eye.xyz);
    var out: Corner;
    out.id = id + 1u;
    // a face turned away goes outside the clip volume
    out.position = vec4<f32>(2.0, 2.0, 2.0, 1.0);
    if (towards > 0.0 || (towards < 0.0 && faces[id].corners[1].w > 0.0)) {
        let point = faces[id].corners[index % 3u].xyz;
        let pixel = vec2<f32>(dot(frame.column.xyz, point), dot(frame.row.xyz, point))
            + vec2<f32>(frame.column.w, frame.row.w);
        let place = pixel * (2.0 / f32(frame.counts.x)) - 1.0;
        // heights of -1.001 .. 1 fill the depths
        let height = dot(frame.eye.xyz, point) - faces[id].corners[0].w;
        out.position = vec4<f32>(place.x, -place.y, 0.5 - 0.499 * height, 1.0);
    }
    return out;
}

@fragment
fn face_id(in: Corner) -> @location(0) u32 {
    return in.id;
}
