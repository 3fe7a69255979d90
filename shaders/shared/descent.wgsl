// Finding the leaf that holds a cell of the grid. A node is one number: A in the highest byte, then R, G, B of its texel.

// The deepest level that a texel can name.
const MAX_DEPTH: u32 = 25u;
// The highest byte of an interior node.
const INTERIOR: u32 = 255u;
const EMPTY: u32 = 0u;

// Whether the march leaps over what is not active, as if it were empty.
override skipping: bool = false;

// One word a block. Bit i: child i is active, a leaf of which something is seen or a node above one; bit 8 + i: it is so as a whole.
@group(0) @binding(15) var<storage, read> activity: array<u32>;

// A leaf, or EMPTY, and its cell.
struct Found {
    word: u32,
    cell: Cell,
}

// What of the tree counts in a descent: all of it; what is active; that, down to nodes that are active as a whole.
const ALL: u32 = 0u;
const ACTIVE: u32 = 1u;
const WHOLE: u32 = 2u;

// The blocks on the way from the root to the last leaf found, its level, and the cell that was asked for.
var<private> stack: array<u32, MAX_DEPTH>;
var<private> stack_level: u32;
var<private> stack_cell: vec3<u32>;

fn grid_cells() -> u32 {
    return 1u << frame.depth;
}

fn leaf_depth(word: u32) -> u32 {
    return (word >> 24u) / 10u;
}

fn leaf_value(word: u32) -> f32 {
    return f32(word & 0x00ffffffu) * (1.0 / 16777215.0);
}

fn start_descent() {
    stack[0] = 0u;
    stack_level = 0u;
    stack_cell = vec3<u32>(0u);
}

// Finds what is to be marched at a cell of the grid.
fn find(at: vec3<u32>) -> Found {
    return descend(at, select(ALL, ACTIVE, skipping));
}

// Starts at the lowest block that holds both `at` and the cell asked for before: the highest bit in which their coordinates differ
// tells its level.
fn descend(at: vec3<u32>, what: u32) -> Found {
    let change = at ^ stack_cell;
    let highest = firstLeadingBit(max(change.x | change.y | change.z, 1u));
    var level = min(stack_level, frame.depth - 1u - highest);
    stack_cell = at;
    var bit = frame.depth - 1u - level;
    var word = visible_node(stack[level], child_of(at, bit), what);
    while ((word >> 24u) == INTERIOR && bit > 0u && !(what == WHOLE && is_whole(stack[level], child_of(at, bit)))) {
        level += 1u;
        bit -= 1u;
        stack[level] = word & 0x00ffffffu;
        word = visible_node(stack[level], child_of(at, bit), what);
    }
    stack_level = level;
    let cell = Cell((at >> vec3<u32>(bit)) << vec3<u32>(bit), 1u << bit);
    return Found(select(word, EMPTY, (word >> 24u) == INTERIOR && what != WHOLE), cell);
}

// A node, EMPTY if it does not count.
fn visible_node(block: u32, child: vec3<u32>, what: u32) -> u32 {
    if (what != ALL && ((activity[block_number(block)] >> child_index(child)) & 1u) == 0u) { return EMPTY; }
    return node(block, child);
}

fn is_whole(block: u32, child: vec3<u32>) -> bool {
    return ((activity[block_number(block)] >> (8u + child_index(child))) & 1u) == 1u;
}

// Which child of a block holds a cell of the grid, if a child's coordinates end at this bit.
fn child_of(at: vec3<u32>, bit: u32) -> vec3<u32> {
    return (at >> vec3<u32>(bit)) & vec3<u32>(1u);
}

fn child_index(child: vec3<u32>) -> u32 {
    return child.x | (child.y << 1u) | (child.z << 2u);
}

// The shortest step in t. With t below 2, f32 still tells apart the two ends of such a step.
const MIN_STEP: f32 = 9.5367431640625e-7;

// L_s in a ray's t, within 2^-11 of it.
fn step_along(ray: Ray) -> f32 {
    return frame.step * inverse_length(ray);
}

// The step at a depth, L(d) = L_s / 2^(d-1).
fn step_at(step: f32, depth: u32) -> f32 {
    return max(ldexp(step, 1 - i32(depth)), MIN_STEP);
}
