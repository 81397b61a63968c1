// A plain tracer of the assignment, a pixel at a time, every ray against every surface: what a compiled language gives
// without a library, for the benchmarks.
//
//   g++ -O3 -march=native -ffast-math -fopenmp -DREAL=double scalar.cpp -o scalar
//   ./scalar scene.txt SIDE DEPTH REPETITIONS [PICTURE]
//
// Prints the seconds of each repetition, without reading and writing; after a second it repeats no more. PICTURE gets
// SIDE x SIDE x 3 levels, not clamped, as float32. With -DCOUNT, and without -fopenmp, it prints instead what one
// repetition computes: sums, products, comparisons, quotients and roots.

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#ifdef COUNT
static struct { long sums, products, quotients, roots, comparisons; } counted;
struct Number {  // a double that counts what is done with it
    double v = 0;
    Number() = default;
    Number(double value) : v(value) {}
    explicit operator float() const { return float(v); }
};
static Number operator+(Number a, Number b) { counted.sums++; return a.v + b.v; }
static Number operator-(Number a, Number b) { counted.sums++; return a.v - b.v; }
static Number operator*(Number a, Number b) { counted.products++; return a.v * b.v; }
static Number operator/(Number a, Number b) { counted.quotients++; return a.v / b.v; }
static Number operator-(Number a) { return -a.v; }
static bool operator<(Number a, Number b) { counted.comparisons++; return a.v < b.v; }
static bool operator>(Number a, Number b) { counted.comparisons++; return a.v > b.v; }
static Number root(Number a) { counted.roots++; return std::sqrt(a.v); }
static Number absolute(Number a) { return std::fabs(a.v); }
using Real = Number;
#else
using Real = REAL;
static inline Real root(Real a) { return std::sqrt(a); }
static inline Real absolute(Real a) { return std::fabs(a); }
#endif

struct Vector { Real x, y, z; };
static inline Vector operator+(Vector a, Vector b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
static inline Vector operator-(Vector a, Vector b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
static inline Vector operator*(Vector a, Real s) { return {a.x * s, a.y * s, a.z * s}; }
static inline Real dot(Vector a, Vector b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline Vector unit(Vector a) { return a * (Real(1) / root(dot(a, a))); }

struct Material { Vector colour, ambient; Real diffuse, reflection; };  // ambient: what is added, light or not
struct Sphere { Vector centre; Real square, inverse; };  // of the radius
struct Plane { Vector normal; Real offset; };            // the unit normal, and a point's product with it

static std::vector<Sphere> spheres;
static std::vector<Plane> planes;
static std::vector<Material> materials;  // of the spheres, then of the planes

static const Vector LIGHT = {500, 500, 500};
static const Real SCREEN = 1, SHADOW = 1e-4;                      // a ray starts after t = 1 or after that
static const Real MIRROR = sizeof(Real) == 4 ? Real(1e-2) : Real(1e-4);  // float cannot tell 1e-4 from its rounding
static const Real PARALLEL = sizeof(Real) == 4 ? Real(1e-7) : Real(1e-12);
static const Real FAR = 1e30;
static const double LONG = 1;  // seconds after which nothing is repeated

// The first surface along a ray after `start`, or -1.
static inline int nearest(Vector origin, Vector d, Real start, Real &best) {
    const int balls = int(spheres.size()), flats = int(planes.size());
    const Real a = dot(d, d), inverse = Real(1) / a;
    int hit = -1;
    best = FAR;
    for (int i = 0; i < balls; i++) {
        const Vector p = origin - spheres[i].centre;
        const Real b = dot(p, d), c = dot(p, p) - spheres[i].square;
        if (b > Real(0) && c > Real(0)) continue;  // it lies behind
        const Real discriminant = b * b - a * c;
        if (discriminant < Real(0)) continue;
        const Real half = root(discriminant);
        Real t = (-b - half) * inverse;
        if (!(t > start)) t = (half - b) * inverse;
        if (t > start && t < best) best = t, hit = i;
    }
    for (int i = 0; i < flats; i++) {
        const Real facing = dot(d, planes[i].normal);
        if (absolute(facing) < PARALLEL) continue;
        const Real t = (planes[i].offset - dot(origin, planes[i].normal)) / facing;
        if (t > start && t < best) best = t, hit = balls + i;
    }
    return hit;
}

// Whether anything lies between a point and the light, at t = 1 along d.
static inline bool blocked(Vector origin, Vector d) {
    const Real a = dot(d, d), low = SHADOW * a;
    for (const Sphere &sphere : spheres) {
        const Vector p = origin - sphere.centre;
        const Real b = dot(p, d), c = dot(p, p) - sphere.square;
        if (b > Real(0) && c > Real(0)) continue;
        const Real discriminant = b * b - a * c;
        if (discriminant < Real(0)) continue;
        const Real half = root(discriminant), near = -b - half, far = half - b;  // both times a
        if ((near > low && near < a) || (far > low && far < a)) return true;
    }
    for (const Plane &plane : planes) {
        Real facing = dot(d, plane.normal), way = plane.offset - dot(origin, plane.normal);
        if (facing < Real(0)) facing = -facing, way = -way;
        if (facing > PARALLEL && way > SHADOW * facing && way < facing) return true;
    }
    return false;
}

static inline Vector trace(Vector d, int depth) {
    const int balls = int(spheres.size());
    Vector origin = {0, 0, 0}, colour = {0, 0, 0};
    Real weight = 1, start = SCREEN;
    for (int bounce = 0;; bounce++) {
        Real t;
        const int hit = nearest(origin, d, start, t);
        if (hit < 0) return colour;
        const Vector point = origin + d * t;
        const Vector normal =
            hit < balls ? (point - spheres[hit].centre) * spheres[hit].inverse : planes[hit - balls].normal;
        const Material &material = materials[hit];
        Vector local = material.ambient;
        const Vector light = LIGHT - point;
        const Real slope = dot(normal, light);
        if (slope > Real(0) && !blocked(point, light))
            local = local + material.colour * (material.diffuse * slope / root(dot(light, light)));
        colour = colour + local * weight;
        if (bounce == depth) return colour;
        weight = weight * material.reflection;
        if (!(absolute(weight) > Real(0))) return colour;
        d = unit(d - normal * (Real(2) * dot(d, normal)));
        origin = point;
        start = MIRROR;
    }
}

static double number(FILE *file) {
    double value;
    if (std::fscanf(file, "%lf", &value) != 1) std::exit(2);
    return value;
}

static Vector vector(FILE *file) {
    const double x = number(file), y = number(file), z = number(file);
    return {Real(x), Real(y), Real(z)};
}

static void read(const char *path) {
    FILE *file = std::fopen(path, "r");
    if (!file) std::exit(2);
    Vector ambient = vector(file);
    ambient = ambient * Real(number(file) / 256);
    for (int kind = 0; kind < 2; kind++)
        for (int left = int(number(file)); left > 0; left--) {
            const Vector colour = vector(file), place = vector(file);
            if (kind == 0) {
                const double radius = number(file);
                spheres.push_back({place, Real(radius * radius), Real(1 / radius)});
            } else {
                const Vector normal = unit(vector(file));
                planes.push_back({normal, dot(place, normal)});
            }
            const double diffuse = number(file), reflection = number(file);
            const Vector added = {colour.x * ambient.x, colour.y * ambient.y, colour.z * ambient.z};
            materials.push_back({colour, added, Real(diffuse), Real(reflection)});
        }
    std::fclose(file);
}

static void render(int side, int depth, std::vector<float> &picture) {
    const Real pitch = 100.0 / side;
#pragma omp parallel for schedule(dynamic, 4)
    for (int row = 0; row < side; row++)
        for (int column = 0; column < side; column++) {
            const Real x = Real(column + 0.5) * pitch - Real(50), y = Real(side - row - 0.5) * pitch - Real(50);
            const Vector colour = trace({x, y, Real(100)}, depth);
            float *pixel = &picture[3 * (size_t(row) * side + column)];
            pixel[0] = float(colour.x), pixel[1] = float(colour.y), pixel[2] = float(colour.z);
        }
}

int main(int count, char **words) {
    if (count < 5) return 1;
    const int side = std::atoi(words[2]), depth = std::atoi(words[3]);
    read(words[1]);
    std::vector<float> picture(size_t(3) * side * side);
#ifdef COUNT
    counted = {};
    render(side, depth, picture);
    std::printf("%ld %ld %ld %ld %ld\n", counted.sums, counted.products, counted.comparisons, counted.quotients,
                counted.roots);
#else
    double all = 0;
    for (int i = std::atoi(words[4]); i > 0 && all < LONG; i--) {
        const auto begin = std::chrono::steady_clock::now();
        render(side, depth, picture);
        const double taken = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
        std::printf("%.6f\n", taken);
        all += taken;
    }
#endif
    if (count > 5) {
        FILE *file = std::fopen(words[5], "wb");
        if (!file || std::fwrite(picture.data(), sizeof(float), picture.size(), file) != picture.size()) return 1;
        std::fclose(file);
    }
}
