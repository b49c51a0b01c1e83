// Where a traced ray arrives: the point on the triangle that Trace() found, how far off rounding may have put it, and where rays
// start that leave it. Computed from the triangle alone, whoever found it.
#ifndef ARRIVAL_GLSL
#define ARRIVAL_GLSL

#include "grazing.glsl"
#include "offset.glsl"
#include "surface.glsl"
#include "trace.glsl"
#include "triangle.glsl"

struct Arrival {
    Found found;
    vec3 position;
    vec3 error;       // the point of the surface lies in the box position +- error
    vec3 faceNormal;  // of unit length, towards the outside of the surface
    vec3 normal;      // the same, interpolated where the object is smooth
    bool behind;      // seen from the inside
    float distance;   // from where the ray started
    vec3 weights;     // of the triangle's corners
    mat2x3 edges;     // from the first corner to the others
    mat2x3 bends;     // how the interpolated normal changes along them, but for its length
};

// Bounds of relative errors after 5 and 7 roundings: Higham 2002, lemma 3.1.
const float GAMMA_5 = 2.9802331e-7;
const float GAMMA_7 = 4.1723269e-7;

mat3 Magnitude(mat4x3 m)
{
    return mat3(abs(m[0]), abs(m[1]), abs(m[2]));
}

// The vertices of the triangle that was found.
uvec3 VerticesOf(Found found)
{
    uint first = 3 * (instances[found.instance].firstTriangle + found.triangle);
    return instances[found.instance].firstVertex + uvec3(triangles[first], triangles[first + 1], triangles[first + 2]);
}

// Where the ray from `origin`, of a direction of unit length, meets the triangle.
Arrival ArriveAt(Found found, vec3 origin, vec3 direction)
{
    mat4x3 toWorld = instances[found.instance].objectToWorld;
    mat4x3 toObject = instances[found.instance].worldToObject;
    uint triangle = instances[found.instance].firstTriangle + found.triangle;
    vec3 a = FetchCorner(triangle, 0);
    vec3 b = FetchCorner(triangle, 1);
    vec3 c = FetchCorner(triangle, 2);

    ShearedRay ray = ShearRay(toObject * vec4(origin, 1.0), mat3(toObject) * direction);
    Meeting meeting;
    // Where a device's own test says that a triangle is met and this one does not, it is next to an edge.
    if (!MeetTriangle(ray, a, b, c, meeting)) meeting = MeetingAtEdge(ray, a, b, c);

    Arrival arrival;
    arrival.found = found;
    arrival.behind = meeting.behind;
    vec3 normal = cross(b - a, c - a);
    arrival.faceNormal = normalize(mat3(instances[found.instance].normalToWorld) * normal);

    // The error of the point, in the world, and once more on its way back into the object's space: rays that leave do that.
    mat3 stretch = Magnitude(toWorld);
    mat3 shrink = Magnitude(toObject);
    vec3 local = meeting.weights.x * a + meeting.weights.y * b + meeting.weights.z * c;
    vec3 reach = meeting.weights.x * abs(a) + meeting.weights.y * abs(b) + meeting.weights.z * abs(c);
    vec3 position = toWorld * vec4(local, 1.0);
    vec3 back = GAMMA_5 * (shrink * abs(position) + abs(toObject[3]));
    arrival.error = stretch * (GAMMA_7 * reach + back) + GAMMA_5 * (stretch * abs(local) + abs(toWorld[3]));

    // A point that rounding may have put beyond an edge is on the wrong side of the next face: it is drawn into the triangle.
    float room = 4.0 * length(shrink * arrival.error);
    vec3 edges = vec3(length(c - b), length(a - c), length(b - a));
    arrival.weights = max(meeting.weights, min(room * edges / length(normal), vec3(0.25)));
    arrival.weights /= arrival.weights.x + arrival.weights.y + arrival.weights.z;
    local = arrival.weights.x * a + arrival.weights.y * b + arrival.weights.z * c;
    arrival.position = toWorld * vec4(local, 1.0);
    arrival.distance = distance(arrival.position, origin);

    arrival.edges = mat2x3(mat3(toWorld) * (b - a), mat3(toWorld) * (c - a));
    arrival.normal = arrival.faceNormal;
    arrival.bends = mat2x3(0.0);
    if (instances[found.instance].smoothNormals != 0) {
        uvec3 vertices = VerticesOf(found);
        vec3 w = meeting.weights;
        vec3 first = FetchNormal(vertices.x);
        vec3 second = FetchNormal(vertices.y);
        vec3 third = FetchNormal(vertices.z);
        mat3 normalToWorld = mat3(instances[found.instance].normalToWorld);
        vec3 interpolated = normalToWorld * (w.x * first + w.y * second + w.z * third);
        float size = length(interpolated);
        if (size > 0.0) {
            arrival.normal = interpolated / size;
            arrival.bends = mat2x3(normalToWorld * (second - first), normalToWorld * (third - first)) * (1.0 / size);
        }
    }
    return arrival;
}

// Where a ray starts that leaves in direction `w`.
vec3 LeaveFrom(Arrival arrival, vec3 w)
{
    return OffsetRayOrigin(arrival.position, arrival.error, arrival.faceNormal, w);
}

#endif
