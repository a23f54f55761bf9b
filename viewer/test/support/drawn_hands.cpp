// Films of hands that nobody has photographed, with their true angles: the hand of
// rendered_hand.mjs in other shapes, sizes, colours, lights and views, drawn fast. With them the
// takes of config/camera (mode signs, seeds 1 to 3, 4 with wildness 0, 21 to 26, 31 to 40, 701 to
// 712) and those of tests/golden/camera (seeds 603, 606, 609, 612, the even ones left) were made.
// Judged once, for no choice: seeds 9101 to 9112 (signs) and 9201 to 9212 (random), even ones left.
//
//   g++ -O3 -ffast-math -std=c++20 drawn_hands.cpp -o drawn_hands
//   ./drawn_hands signs|shows|random SEED PICTURES OUT [WILDNESS [left]]
//                                                       writes OUT.rgba and OUT.truth, 10 Hz
//   node find_hands.mjs OUT                                          OUT.hands: what is found
//   POSED_FILM=OUT build/bin/unit_drivers "[.takes]"                 OUT.take: what posed sees
//
// A row of OUT.truth has the 45 angles of hand45 [deg], the gesture, and whether it is held (since
// 0.2 s). "signs" performs g c p 1 3 4 as the synthetic signer does, "random" any poses.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <random>
#include <string>
#include <vector>
using std::array;
using V = array<double, 3>;
using M = array<V, 3>;
static V add(V a, V b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
static V sub(V a, V b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
static V sc(V a, double s) { return {a[0] * s, a[1] * s, a[2] * s}; }
static double dot(const V& a, const V& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
static double len(V a) { return std::sqrt(dot(a, a)); }
static V unit(V a) { return sc(a, 1 / len(a)); }
static V mul(const M& m, const V& v) { return {dot(m[0], v), dot(m[1], v), dot(m[2], v)}; }
static M mm(const M& a, const M& b) {
  M r;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) r[i][j] = a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j];
  return r;
}
static M tr(const M& m) {
  M r;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) r[i][j] = m[j][i];
  return r;
}
static M rot(char ax, double deg) {
  double c = cos(deg * M_PI / 180), s = sin(deg * M_PI / 180);
  if (ax == 'x') return {V{1, 0, 0}, V{0, c, -s}, V{0, s, c}};
  if (ax == 'y') return {V{c, 0, s}, V{0, 1, 0}, V{-s, 0, c}};
  return {V{c, -s, 0}, V{s, c, 0}, V{0, 0, 1}};
}
static M frameOf(V f) { return mm(mm(rot('y', f[1]), rot('x', f[0])), rot('z', f[2])); }
struct F {
  V base;
  V length;
  V radius;
  M frame, root;
};
struct Cap {
  V a, b;
  double r0, r1;
};
std::mt19937 R;
double U(double a, double b) { return std::uniform_real_distribution<>(a, b)(R); }
double N() { return std::normal_distribution<>()(R); }
static array<F, 5> adult() {
  M I = rot('x', 0);
  return {
      {{{20, -8, 24}, {44, 33, 27}, {11, 10, 9}, frameOf({16, 26, -67}), frameOf({37, -5, -37})},
       {{24, 0, 92}, {43, 25, 22}, {9, 8, 7}, I, I},
       {{3, 2, 95}, {47, 29, 24}, {9, 8, 7}, I, I},
       {{-17, 0, 89}, {44, 27, 24}, {8.5, 7.5, 7}, I, I},
       {{-36, -4, 82}, {35, 20, 21}, {7.5, 7, 6.5}, I, I}}};
}
struct Look {
  double up, away, focal;
  V light, skin;
  double wallb, wallc, noise, blend, thick, palmw;
};
using Pose = array<array<V, 3>, 5>;
std::vector<Cap> caps(const array<F, 5>& sh, const Pose& hand, const M& turn, const Look& L) {
  std::vector<Cap> all;
  M view = mm(turn, M{V{1, 0, 0}, V{0, 0, -1}, V{0, 1, 0}});
  auto put = [&](V a, V b, double r0, double r1) {
    all.push_back({mul(view, a), mul(view, b), r0 * L.thick, r1 * L.thick});
  };
  std::vector<V> kn;
  for (int f = 0; f < 5; f++) {
    V at = sh[f].base;
    M before = rot('x', 0);
    for (int j = 0; j < 3; j++) {
      V a = hand[f][j];
      double sg = f > 2 ? -1 : 1;
      const M& ch = j == 0 ? sh[f].root : sh[f].frame;
      M own = mm(mm(rot('z', sg * a[2]), rot('x', a[0])), rot('y', sg * a[1]));
      before = mm(before, mm(mm(ch, own), tr(ch)));
      V to = add(at, mul(before, mul(sh[f].frame, {0, 0, sh[f].length[j]})));
      put(at, to, sh[f].radius[j], sh[f].radius[std::min(j + 1, 2)] * (j == 2 ? 0.9 : 1));
      at = to;
    }
    if (f > 0) kn.push_back(sh[f].base);
  }
  double w = L.palmw;
  for (int i = 0; i < 4; i++) {
    put({(12 - 9 * i) * w, -2, 4}, kn[i], 13, 11);
    if (i > 0) put(kn[i - 1], kn[i], 10, 10);
  }
  put({14 * w, -6, 12}, sh[0].base, 13, 13);
  put({16 * w, -14, 22}, {20 * w, -12, 58}, 15, 11);
  put({-22 * w, -9, 22}, {-29 * w, -9, 62}, 14, 11);
  put({0, -2, 8}, {0, -4, -130}, 21, 27);
  return all;
}
static double d1(const Cap& c, const V& p) {
  V al = sub(c.b, c.a);
  double t = std::min(1., std::max(0., dot(sub(p, c.a), al) / dot(al, al)));
  return len(sub(sub(p, c.a), sc(al, t))) - (c.r0 + t * (c.r1 - c.r0));
}
static double dist(const std::vector<const Cap*>& cs, const V& p, double B) {
  double least = 1e9;
  bool first = true;
  for (auto* c : cs) {
    double d = d1(*c, p);
    double near = first ? 0 : std::max(0., B - std::abs(d - least)) / B;
    least = std::min(d, least) - near * near * B / 4;
    first = false;
  }
  return least;
}
const int W = 320, H = 240;
void draw(const std::vector<Cap>& all, const Look& L, unsigned char* out) {
  double foc = L.focal * W;
  struct S {
    double x, y, q;
  };
  std::vector<S> sh;
  for (auto& c : all) {
    double s1 = foc / (c.a[2] + L.away), s2 = foc / (c.b[2] + L.away);
    double ax = W / 2 + s1 * c.a[0], ay = H / 2 + s1 * (c.a[1] + L.up), bx = W / 2 + s2 * c.b[0],
           by = H / 2 + s2 * (c.b[1] + L.up);
    double re = std::hypot(ax - bx, ay - by) / 2,
           ro = 1.15 * std::max(s1, s2) * (std::max(c.r0, c.r1) + L.blend);
    sh.push_back({(ax + bx) / 2, (ay + by) / 2, (re + ro) * (re + ro)});
  }
  for (int y = 0; y < H; y++)
    for (int x = 0; x < W; x++) {
      double g = L.wallb + L.wallc * y / H + 12 * sin(x / 37.);
      V col = {g, g * 1.02, g * 1.06};
      std::vector<const Cap*> cs;
      for (size_t i = 0; i < all.size(); i++)
        if ((sh[i].x - x) * (sh[i].x - x) + (sh[i].y - y) * (sh[i].y - y) < sh[i].q)
          cs.push_back(&all[i]);
      if (!cs.empty()) {
        V ray = unit({(x - W / 2.) / foc, (y - H / 2.) / foc, 1}), o = {0, -L.up, -L.away};
        double far = L.away - 160;
        for (int i = 0; i < 48 && far < L.away + 160; i++) {
          V p = add(o, sc(ray, far));
          double d = dist(cs, p, L.blend);
          if (d < 0.3) {
            V n;
            for (int k = 0; k < 3; k++) {
              V q = p;
              q[k] += 0.6;
              n[k] = dist(cs, q, L.blend) - d;
            }
            n = unit(n);
            double open = std::max(0., std::min(1., dist(cs, add(p, sc(n, 9)), L.blend) / 9));
            double li = (0.45 + 0.55 * std::max(0., dot(n, L.light))) * (0.55 + 0.45 * open);
            col = sc(L.skin, li);
            break;
          }
          far += d;
        }
      }
      double nz = L.noise * U(-.5, .5);
      for (int k = 0; k < 3; k++)
        out[4 * (y * W + x) + k] = (unsigned char)std::max(0., std::min(255., col[k] + nz));
      out[4 * (y * W + x) + 3] = 255;
    }
}
static double mj(double t) {
  t = std::min(1., std::max(0., t));
  return t * t * t * (10 - 15 * t + 6 * t * t);
}
struct Sensor {
  int f, j, a;
  array<double, 3> d;
};
const Sensor S[19] = {
    {0, 0, 2, {38, 20, 5}}, {0, 1, 0, {45, 20, 6}}, {0, 2, 0, {50, 15, 4}}, {0, 0, 1, {8, 15, 35}},
    {1, 0, 0, {66, 12, 6}}, {1, 1, 0, {92, 14, 5}}, {1, 2, 0, {52, 8, 3}},  {1, 0, 1, {1, 12, 8}},
    {2, 0, 0, {72, 10, 5}}, {2, 1, 0, {95, 12, 4}}, {2, 2, 0, {56, 8, 3}},  {3, 0, 0, {74, 14, 7}},
    {3, 1, 0, {94, 18, 6}}, {3, 2, 0, {54, 10, 4}}, {3, 0, 1, {1, 4, 9}},   {4, 0, 0, {70, 18, 9}},
    {4, 1, 0, {88, 20, 8}}, {4, 2, 0, {50, 12, 5}}, {4, 0, 1, {3, 8, 18}}};
const char* names[6] = {"g", "c", "p", "1", "3", "4"};
const int st[6][5] = {{0, 0, 0, 0, 0}, {0, 1, 1, 0, 0}, {2, 2, 2, 2, 2},
                      {0, 2, 0, 0, 0}, {0, 2, 2, 2, 0}, {0, 2, 2, 2, 2}};
double carriage[19], range_[19];
Pose sign(int g) {
  Pose p{};
  double vig[5];
  for (auto& v : vig) v = 1 + 0.04 * N();
  for (int s = 0; s < 19; s++)
    p[S[s].f][S[s].j][S[s].a] = range_[s] * vig[S[s].f] * S[s].d[st[g][S[s].f]] + carriage[s] + N();
  return p;
}
// A natural random pose: a curl a finger, coupling of the joints with scatter; nothing of the
// signs.
Pose randomPose() {
  Pose p{};
  double common = U(0, 1);
  for (int f = 1; f < 5; f++) {
    double curl = std::min(1., std::max(0., U(0, 1) < 0.4 ? common + 0.15 * N() : U(-.05, 1.05)));
    p[f][0][0] = std::min(92., std::max(-12., 80 * curl + 14 * N()));
    p[f][1][0] = std::min(108., std::max(0., 95 * curl + 12 * N()));
    p[f][2][0] = std::min(78., std::max(-5., 0.6 * p[f][1][0] + 9 * N()));
    p[f][0][1] = (1 - curl) * (f == 2 ? U(-8, 8) : U(-5, 22));
  }
  p[0][0][2] = U(0, 60);
  p[0][0][1] = U(0, 42);
  p[0][1][0] = U(0, 55);
  p[0][2][0] = U(-5, 65);
  return p;
}
Pose mix(const Pose& a, const Pose& b, double t) {
  Pose r;
  for (int f = 0; f < 5; f++)
    for (int j = 0; j < 3; j++)
      for (int k = 0; k < 3; k++) r[f][j][k] = a[f][j][k] + t * (b[f][j][k] - a[f][j][k]);
  return r;
}
// "shows": g, c and 1 are shown three times each, from p and back, as they are taught on the stage;
// then anything follows, 3 and 4, too, which were not taught.
const int kShows = 27;
int shown(int n) {
  const int taught[3] = {0, 1, 3};
  if (n >= kShows) {
    static int last = 2;
    int next;
    do next = std::uniform_int_distribution<>(0, 5)(R);
    while (next == last);
    return last = next;
  }
  return n % 3 == 1 ? taught[n / 9 % 3] : 2;
}
int main(int c, char** v) {
  std::string mode = v[1];
  int seed = atoi(v[2]), frames = atoi(v[3]);
  std::string out = v[4];
  R.seed(seed * 7919 + (mode == "signs" ? 1 : 2));
  double wild = c > 5 ? atof(v[5]) : 1;
  auto sh = adult();
  double size = 1 + wild * U(-.1, .1);
  double thick = 1 + wild * U(-.12, .15);
  for (int f = 0; f < 5; f++) {
    double l = size * (1 + wild * U(-.08, .08));
    for (int j = 0; j < 3; j++) sh[f].length[j] *= l * (1 + wild * U(-.05, .05));
    for (int k = 0; k < 3; k++) sh[f].base[k] *= size * (1 + wild * U(-.04, .04));
  }
  Look L;
  L.thick = thick;
  L.palmw = size;
  L.blend = 5;
  L.up = 70 + wild * U(-25, 15);
  L.away = 420 + wild * U(-40, 120);
  L.focal = 1.05;
  L.light = unit({-0.4 + wild * U(-.5, .9), -0.6 + wild * U(-.3, .4), -0.75});
  double s = 1 - wild * U(0, .35);
  L.skin = {235 * s, 178 * s * (1 - wild * U(0, .08)), 148 * s * (1 - wild * U(0, .12))};
  L.wallb = 150 + wild * U(-90, 20);
  L.wallc = 40;
  L.noise = 6 + wild * U(0, 6);
  for (auto& x : carriage) x = U(-3, 3);
  for (auto& x : range_) x = U(.92, 1.08);
  double ry = wild * U(-20, 20), rz = wild * U(-15, 15), rx = wild * U(-12, 12);
  FILE *fr = fopen((out + ".rgba").c_str(), "wb"), *ft = fopen((out + ".truth").c_str(), "w");
  std::vector<unsigned char> buf(W * H * 4);
  int at = -1, n = 0;
  Pose from{}, to{};
  double move = 0, hold = 0;
  double t0 = 0;
  const double rate = 10;
  double late[5];
  for (auto& l : late) l = U(-.05, .05);
  double drift = U(0, 6);
  for (int i = 0; i < frames; i++) {
    double t = i / rate;
    if (at < 0 || t - t0 >= move + hold) {
      t0 = t;
      from = to;
      if (mode == "shows") {
        at = shown(n);
        to = sign(at);
        if (i == 0) from = to;
        move = U(.4, .7);
        hold = n < kShows && at != 2 ? U(1.8, 2.4) : n < kShows ? U(.8, 1.1) : U(1.1, 1.9);
      } else if (mode == "signs") {
        int nx;
        do nx = std::uniform_int_distribution<>(0, 5)(R);
        while (nx == at);
        at = nx;
        to = sign(at);
        if (i == 0) from = to;
        move = U(.4, .7);
        hold = U(1.1, 1.9);
      } else {
        at = 0;
        to = randomPose();
        if (i == 0) from = to;
        move = U(.25, .5);
        hold = U(.2, .6);
      }
      n++;
    }
    double u = mj((t - t0) / move);
    Pose p = mix(from, to, u);
    M turn = mm(mm(rot('y', ry + 8 * sin(t * .7 + drift)), rot('x', rx + 5 * sin(t * .5))),
                rot('z', rz + 5 * cos(t * .6 + drift)));
    draw(caps(sh, p, turn, L), L, buf.data());
    if (c > 6)  // a left hand is the mirror image
      for (int y = 0; y < H; y++)
        for (int x = 0; x < W / 2; x++)
          std::swap_ranges(&buf[4 * (y * W + x)], &buf[4 * (y * W + x) + 4],
                           &buf[4 * (y * W + W - 1 - x)]);
    fwrite(buf.data(), 1, buf.size(), fr);
    for (int f = 0; f < 5; f++)
      for (int j = 0; j < 3; j++)
        for (int k = 0; k < 3; k++) fprintf(ft, "%.2f ", p[f][j][k]);
    fprintf(ft, "%s %d\n", mode == "random" ? "x" : names[at], t - t0 >= move + 0.2 ? 1 : 0);
  }
  fclose(fr);
  fclose(ft);
}
