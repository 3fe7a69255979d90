// The parts of rays that hold all that is active, found by the stage `intervals`: per pixel, nearest first, (~bits of the t where a part
// begins, bits of the t where it ends); 0 for a part that holds nothing. The larger of two such words is the wider part's.

@group(0) @binding(16) var<storage, read> part_words: array<vec2<u32>>;

// The first word of the ray's parts, and the part that comes next.
var<private> part_first: u32;
var<private> part_next: u32;

fn start_parts(pixel: vec2<u32>) {
    part_first = parts * (pixel.x + frame.width * pixel.y);
    part_next = 0u;
}

// The next part that holds something, joined with those that begin where it ends: (begin, end), or (FAR, -FAR). Without parts, all of the
// ray at once.
fn next_part() -> vec2<f32> {
    if (parts == 0u) {
        part_next += 1u;
        return select(vec2<f32>(FAR, -FAR), vec2<f32>(0.0, FAR), part_next == 1u);
    }
    var part = vec2<f32>(FAR, -FAR);
    while (part_next < parts) {
        let words = part_words[part_first + part_next];
        if (words.x != 0u) {
            let begin = bitcast<f32>(~words.x);
            if (part.x < FAR && begin > part.y) { break; }
            part = vec2<f32>(min(part.x, begin), bitcast<f32>(words.y));
        }
        part_next += 1u;
    }
    return part;
}
