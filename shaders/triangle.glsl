// Where a ray meets a triangle, watertight: Woop, Benthin & Wald, "Watertight Ray/Triangle Intersection", JCGT 2013.
//
// Seen along the ray a triangle's corners are points of a plane, the same for every triangle that shares them. Which
// side of an edge the ray passes is the sign of a difference of two products. Rounding does not change the order of
// products: the sign is right or 0, and with 0 as inside for the triangles on both sides no ray slips through an edge
// or a corner.
#ifndef TRIANGLE_GLSL
#define TRIANGLE_GLSL

// A ray with its axes turned so that the largest part of its direction is z.
struct ShearedRay {
    vec3 origin;
    vec3 shear;   // x and y per z, and 1 / z
    int axis;     // which one became z
};

// x, y and z in a cyclic order, so that right-handed stays right-handed.
vec3 Permute(vec3 v, int axis)
{
    return axis == 0 ? v.yzx : axis == 1 ? v.zxy : v;
}

ShearedRay ShearRay(vec3 origin, vec3 direction)
{
    vec3 size = abs(direction);
    int axis = size.x > size.y && size.x > size.z ? 0 : size.y > size.z ? 1 : 2;
    vec3 turned = Permute(direction, axis);
    float inverse = 1.0 / turned.z;
    return ShearedRay(origin, vec3(turned.xy * inverse, inverse), axis);
}

// A triangle met by a ray.
struct Meeting {
    float t;        // in lengths of the ray's direction
    vec3 weights;   // of the corners, their sum is 1
    bool behind;    // seen from the side where the corners are clockwise
};

// What rounding may do to a distance along a ray: this share of how far the corners are.
const float DOUBT = 1e-6;

// Whether the plane through `a`, `b` and `c` lies ahead of the origin and not behind it. It tells where the distance
// along the ray is in doubt: a ray that has just left the plane starts beside it by no more than what rounding can
// move a point across it, which may be far less than what it can move one along the ray.
bool IsPlaneAhead(vec3 direction, vec3 a, vec3 b, vec3 c)
{
    vec3 normal = cross(b - a, c - a);
    return (dot(a, normal) > 0.0) == (dot(direction, normal) > 0.0);
}

// The corners as the ray sees them, and the areas of the parts of the triangle that its edges make with it: of one sign inside.
vec3 AreasSeenBy(ShearedRay ray, inout vec3 a, inout vec3 b, inout vec3 c)
{
    a = Permute(a - ray.origin, ray.axis);
    b = Permute(b - ray.origin, ray.axis);
    c = Permute(c - ray.origin, ray.axis);
    precise float ax = a.x - ray.shear.x * a.z;
    precise float ay = a.y - ray.shear.y * a.z;
    precise float bx = b.x - ray.shear.x * b.z;
    precise float by = b.y - ray.shear.y * b.z;
    precise float cx = c.x - ray.shear.x * c.z;
    precise float cy = c.y - ray.shear.y * c.z;
    precise vec3 areas = vec3(cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax);
    return areas;
}

// Where a ray that passes by a triangle comes closest to it, nearly.
Meeting MeetingAtEdge(ShearedRay ray, vec3 a, vec3 b, vec3 c)
{
    vec3 areas = AreasSeenBy(ray, a, b, c);
    bool behind = (areas.x + areas.y + areas.z < 0.0) != (ray.shear.z < 0.0);
    areas = max(areas.x + areas.y + areas.z < 0.0 ? -areas : areas, vec3(0.0));
    float sum = areas.x + areas.y + areas.z;
    return Meeting(0.0, sum > 0.0 ? areas / sum : vec3(1.0 / 3.0), behind);
}

// Whether the ray passes through the triangle.
bool MeetTriangle(ShearedRay ray, vec3 a, vec3 b, vec3 c, out Meeting meeting)
{
    vec3 areas = AreasSeenBy(ray, a, b, c);
    if (min(min(areas.x, areas.y), areas.z) < 0.0 && max(max(areas.x, areas.y), areas.z) > 0.0) return false;
    float determinant = areas.x + areas.y + areas.z;
    if (determinant == 0.0) return false;
    meeting.weights = areas / determinant;
    meeting.t = dot(meeting.weights, vec3(a.z, b.z, c.z)) * ray.shear.z;
    meeting.behind = (determinant < 0.0) != (ray.shear.z < 0.0);
    if (abs(meeting.t) > DOUBT * max(max(abs(a.z), abs(b.z)), abs(c.z)) * abs(ray.shear.z)) return meeting.t > 0.0;
    meeting.t = max(meeting.t, 0.0);
    return IsPlaneAhead(vec3(ray.shear.xy, 1.0) / ray.shear.z, a, b, c);
}

#endif
