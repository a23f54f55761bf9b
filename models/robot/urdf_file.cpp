#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <iomanip>
#include <limits>
#include <sstream>
#include <tuple>
#include <vector>

#include <Eigen/Eigenvalues>
#include <pugixml.hpp>

#include "proto/text/lower.hpp"

#include "models/robot/urdf.hpp"
#include "proto/text/load_file.hpp"

namespace posed::robot {
namespace {

constexpr std::uintmax_t kMaxMeshBytes = std::uintmax_t{16} << 20;
constexpr std::uintmax_t kMaxAllMeshBytes = std::uintmax_t{64} << 20;
constexpr int kFoldersAbove = 2;
constexpr double kMaxCorner_m = 1e4;
constexpr double kMaxMesh_m = 1.0;

using Corners = std::vector<Eigen::Vector3d>;

void add_corner(Corners& corners, const Eigen::Vector3d& corner) {
  if (corner.allFinite() && corner.norm() < kMaxCorner_m) corners.push_back(corner);
}

// The corners of a text's lines that begin with a word: "v" in an .obj, "vertex" in an .stl.
Corners corners_of_lines(std::string_view text, std::string_view word) {
  Corners corners;
  const auto skip_spaces = [](std::string_view& words) {
    words.remove_prefix(std::min(words.find_first_not_of(" \t"), words.size()));
  };
  while (!text.empty()) {
    std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    skip_spaces(line);
    if (!line.starts_with(word) || line.size() == word.size()) continue;
    line.remove_prefix(word.size());
    if (line[0] != ' ' && line[0] != '\t') continue;
    Eigen::Vector3d corner = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
    for (double& value : corner) {
      skip_spaces(line);
      if (line.starts_with('+')) line.remove_prefix(1);
      const auto read = std::from_chars(line.data(), line.data() + line.size(), value);
      if (read.ec != std::errc()) break;
      line.remove_prefix(static_cast<std::size_t>(read.ptr - line.data()));
    }
    add_corner(corners, corner);
  }
  return corners;
}

// Its head of 80 bytes may begin with "solid", too: the number of triangles tells.
Corners corners_of_stl(std::string_view bytes) {
  constexpr std::size_t kHead = 84, kTriangle = 50, kNormal = 12, kCorner = 12;
  std::uint32_t triangles = 0;
  if (bytes.size() >= kHead) std::memcpy(&triangles, &bytes[kHead - sizeof triangles], 4);
  if (triangles == 0 || (bytes.size() - kHead) / kTriangle < triangles) {
    return corners_of_lines(bytes, "vertex");
  }
  Corners corners;
  for (std::size_t k = 0; k < std::size_t{3} * triangles; ++k) {
    std::array<float, 3> corner{};
    std::memcpy(corner.data(), &bytes[kHead + k / 3 * kTriangle + kNormal + k % 3 * kCorner],
                sizeof corner);
    add_corner(corners, Eigen::Vector3f(corner.data()).cast<double>());
  }
  return corners;
}

// Where a mesh is: "meshes/a.stl" beside the URDF; "package://name/meshes/a.stl" there or beside
// one of the two folders above, as packages are laid out. Nothing outside of these is read.
std::filesystem::path find_mesh(const std::filesystem::path& urdf, std::string name) {
  std::error_code ignored;
  std::vector<std::filesystem::path> folders{
      std::filesystem::absolute(urdf, ignored).lexically_normal().parent_path()};
  for (int k = 0; k < kFoldersAbove; ++k) folders.push_back(folders.back().parent_path());
  bool in_package = false;
  for (const std::string_view scheme : {"package://", "model://", "file://"}) {
    if (!name.starts_with(scheme)) continue;
    name = name.substr(scheme.size());
    in_package = scheme != "file://";
    if (in_package) name = name.substr(name.find('/') + 1);  // all of it where there is no package
  }
  if (in_package && name.starts_with('/')) return {};
  for (const auto& folder : folders) {
    const auto path = (folder / name).lexically_normal();
    const auto inside = path.lexically_relative(folders.back());
    if (inside.empty() || *inside.begin() == "..") continue;
    if (std::filesystem::exists(path, ignored)) return path;
    if (!in_package) break;
  }
  return {};
}

// The corners of a mesh, or why it has none.
Result<Corners> corners_of_mesh(const std::filesystem::path& urdf, const std::string& name,
                                std::uintmax_t& left_bytes) {
  const std::string extension = lower(std::filesystem::path(name).extension().string());
  if (extension != ".obj" && extension != ".stl") {
    return fail("posed reads .stl and .obj: convert them");
  }
  const auto path = find_mesh(urdf, name);
  if (path.empty()) {
    return fail("they are not where the URDF names them, in its folder or the two above");
  }
  const auto text = load_file(path, {.what = "mesh", .max_bytes = kMaxMeshBytes});
  if (!text) return fail("they cannot be read, or are larger than 16 MB");
  if (text->starts_with("version https://git-lfs")) {
    return fail("they are pointers of git-lfs: fetch them by `git lfs pull`");
  }
  if (text->size() > left_bytes) return fail("all meshes together are larger than 64 MB");
  left_bytes -= text->size();
  auto corners = extension == ".obj" ? corners_of_lines(*text, "v") : corners_of_stl(*text);
  if (extension == ".stl") {  // which says each corner once a triangle
    const auto as_tuple = [](const Eigen::Vector3d& v) { return std::tuple(v.x(), v.y(), v.z()); };
    std::ranges::sort(corners, {}, as_tuple);
    const auto same = std::ranges::unique(corners);
    corners.erase(same.begin(), same.end());
  }
  if (corners.size() < 4) return fail("they hold no mesh");
  return corners;
}

struct Fit {
  Eigen::Isometry3d at = Eigen::Isometry3d::Identity();
  double radius_m = 0.0, length_m = 0.0;
};

// A capsule along z of `axes` that holds all corners: around the smallest circle that holds them
// across (Badoiu and Clarkson's steps; of very many corners only some lead them), as long as those
// at the ends need.
Fit fit_along(const Corners& corners, const Eigen::Matrix3d& axes) {
  constexpr int kSteps = 100;
  constexpr std::size_t kLeading = 10000;
  Corners local;
  for (const auto& corner : corners) local.emplace_back(axes.transpose() * corner);
  Eigen::Vector2d circle = local.front().head<2>();
  const auto away = [&](const Eigen::Vector3d& corner) {
    return (corner.head<2>() - circle).norm();
  };
  const auto farthest = [&](std::size_t each) {
    std::size_t best = 0;
    double most2 = -1.0;
    for (std::size_t c = 0; c < local.size(); c += each) {
      const double away2 = (local[c].head<2>() - circle).squaredNorm();
      if (away2 <= most2) continue;
      most2 = away2;
      best = c;
    }
    return local[best];
  };
  for (int i = 1; i <= kSteps; ++i) {
    circle += (farthest(1 + local.size() / kLeading).head<2>() - circle) / (i + 1.0);
  }
  Fit fit;
  fit.radius_m = away(farthest(1));
  double low = 1e9, high = -1e9;
  for (const auto& corner : local) {
    const double cap =
        std::sqrt(std::max(0.0, fit.radius_m * fit.radius_m - away(corner) * away(corner)));
    low = std::min(low, corner.z() + cap);
    high = std::max(high, corner.z() - cap);
  }
  // Where the caps hold all, it is a ball.
  if (low > high) low = high = 0.5 * (low + high);
  fit.length_m = high - low;
  fit.at.linear() = axes;
  fit.at.translation() = axes * Eigen::Vector3d(circle.x(), circle.y(), 0.5 * (low + high));
  return fit;
}

// The smallest of those along the corners' three main directions and along the file's.
Fit fit_capsule(const Corners& corners) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& corner : corners) mean += corner / static_cast<double>(corners.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const auto& corner : corners) spread += (corner - mean) * (corner - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
  Eigen::Matrix3d main = solver.eigenvectors();
  if (main.determinant() < 0.0) main.col(0) = -main.col(0);
  Fit best;
  double least = 1e9;
  for (const Eigen::Matrix3d& frame : {main, Eigen::Matrix3d(Eigen::Matrix3d::Identity())}) {
    for (int k = 0; k < 3; ++k) {
      Eigen::Matrix3d axes;
      axes << frame.col((k + 1) % 3), frame.col((k + 2) % 3), frame.col(k);
      const Fit fit = fit_along(corners, axes);
      const double volume = fit.radius_m * fit.radius_m * (fit.length_m + 4.0 / 3.0 * fit.radius_m);
      if (volume >= least) continue;
      least = volume;
      best = fit;
    }
  }
  return best;
}

// What is no three numbers is `otherwise`.
Eigen::Vector3d three(const pugi::xml_attribute& text, const Eigen::Vector3d& otherwise) {
  std::istringstream numbers(text.value());
  Eigen::Vector3d read;
  const bool good = numbers >> read.x() >> read.y() >> read.z() && read.allFinite();
  return good ? read : otherwise;
}

std::string words(const Eigen::Vector3d& v) {
  std::ostringstream out;
  out.precision(9);
  out << v.x() << ' ' << v.y() << ' ' << v.z();
  return out.str();
}

// Rounded to micrometres, for which the radius makes up.
void append_hull(pugi::xml_node geometry, const Hull& hull) {
  std::ostringstream out;
  out << std::fixed << std::setprecision(6);
  for (const auto& corner : hull.corners) {
    out << corner.x() << ' ' << corner.y() << ' ' << corner.z() << ' ';
  }
  pugi::xml_node node = geometry.append_child("hull");
  node.append_attribute("radius") = std::to_string(hull.radius_m + 2e-6).c_str();
  node.append_attribute("corners") = out.str().c_str();
}

Result<> replace_mesh(pugi::xml_node collision, const std::filesystem::path& urdf,
                      std::uintmax_t& left_bytes) {
  pugi::xml_node geometry = collision.child("geometry");
  const pugi::xml_node mesh = geometry.child("mesh");
  auto corners = TRY(corners_of_mesh(urdf, mesh.attribute("filename").value(), left_bytes));
  if (const pugi::xml_attribute given = mesh.attribute("scale")) {
    const Eigen::Vector3d scale = three(given, Eigen::Vector3d::Zero());
    for (auto& corner : corners) corner = corner.cwiseProduct(scale);
  }
  const Fit fit = fit_capsule(corners);
  if (!(fit.radius_m > 0.0)) return fail("their scale is no three numbers, or zero");
  if (fit.radius_m + fit.length_m > kMaxMesh_m) {
    return fail("they are larger than 1 m: where they are in mm, their scale is 0.001");
  }
  pugi::xml_node origin = collision.child("origin");
  if (!origin) origin = collision.append_child("origin");
  const Eigen::Vector3d rpy = three(origin.attribute("rpy"), Eigen::Vector3d::Zero());
  Eigen::Isometry3d at = Eigen::Isometry3d::Identity();
  at.translation() = three(origin.attribute("xyz"), Eigen::Vector3d::Zero());
  at.linear() = turn_of_rpy(rpy);
  at = at * fit.at;
  const Eigen::Vector3d zyx = at.linear().eulerAngles(2, 1, 0);
  origin.remove_attributes();
  origin.append_attribute("xyz") = words(at.translation()).c_str();
  origin.append_attribute("rpy") = words({zyx.z(), zyx.y(), zyx.x()}).c_str();
  geometry.remove_children();
  pugi::xml_node capsule = geometry.append_child("capsule");
  capsule.append_attribute("radius") = std::to_string(fit.radius_m + 1e-6).c_str();
  capsule.append_attribute("length") = std::to_string(fit.length_m + 1e-6).c_str();
  for (auto& corner : corners) corner = fit.at.inverse() * corner;
  append_hull(geometry, hull_of(corners));
  return {};
}

// Whether a visual has a shape that could be a collision's.
bool has_shape(const pugi::xml_node& visual) {
  const pugi::xml_node geometry = visual.child("geometry");
  if (geometry.child("mesh")) return true;
  if (const pugi::xml_node box = geometry.child("box")) {
    return (three(box.attribute("size"), Eigen::Vector3d::Zero()).array() > 0.0).all();
  }
  if (const pugi::xml_node cylinder = geometry.child("cylinder")) {
    return cylinder.attribute("radius").as_double() > 0.0 &&
           cylinder.attribute("length").as_double() > 0.0;
  }
  return geometry.child("sphere").attribute("radius").as_double() > 0.0;
}

// In a URDF without collision shapes what is seen of it stands for them.
void use_visuals(pugi::xml_node& robot) {
  constexpr int kMaxVisuals = 200;
  const auto links = robot.children("link");
  if (std::ranges::any_of(links, [](const auto& link) { return bool(link.child("collision")); })) {
    return;
  }
  int used = 0;
  for (const pugi::xml_node link : links) {
    for (pugi::xml_node visual = link.child("visual"); visual;) {
      const pugi::xml_node next = visual.next_sibling("visual");
      if (used < kMaxVisuals && has_shape(visual)) {
        visual.set_name("collision");
        ++used;
      }
      visual = next;
    }
  }
  if (used > 0) robot.append_attribute("shapes") = "visual";
}

}  // namespace

Result<std::string> load_urdf(const std::string& path) {
  const auto text = TRY(load_file(path, {.what = "URDF", .max_bytes = kMaxUrdfBytes}));
  TRY(parse_urdf(text, path));
  pugi::xml_document document;
  document.load_buffer(text.data(), text.size());
  pugi::xml_node robot = document.child("robot");
  for (const char* other : {"material", "gazebo", "transmission", "mujoco"}) {
    while (robot.remove_child(other)) {
    }
  }
  use_visuals(robot);
  std::uintmax_t left_bytes = kMaxAllMeshBytes;
  for (pugi::xml_node link : robot.children("link")) {
    for (const char* other : {"visual", "inertial"}) {
      while (link.remove_child(other)) {
      }
    }
    for (const pugi::xml_node collision : link.children("collision")) {
      pugi::xml_node mesh = collision.child("geometry").child("mesh");
      if (!mesh) continue;
      const auto done = replace_mesh(collision, path, left_bytes);
      if (!done) mesh.append_attribute("unused") = done.error().message.c_str();
    }
  }
  std::ostringstream out;
  document.save(out, "", pugi::format_raw);
  return out.str();
}

}  // namespace posed::robot
