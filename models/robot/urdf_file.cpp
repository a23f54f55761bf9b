#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <sstream>
#include <vector>

#include <Eigen/Eigenvalues>
#include <pugixml.hpp>

#include "models/robot/urdf.hpp"
#include "proto/text/load_file.hpp"

namespace posed::robot {
namespace {

constexpr std::uintmax_t kMaxMeshBytes = std::uintmax_t{16} << 20;

std::vector<Eigen::Vector3d> corners_of(const std::string& text) {
  std::vector<Eigen::Vector3d> corners;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("v ")) continue;
    std::istringstream numbers(line.substr(2));
    Eigen::Vector3d corner;
    if (numbers >> corner.x() >> corner.y() >> corner.z() && corner.allFinite() &&
        corner.norm() < 1e4) {
      corners.push_back(corner);
    }
  }
  return corners;
}

// "package://name/meshes/a.obj", the same as "model://", and "meshes/a.obj" are looked for beside
// the URDF.
std::filesystem::path beside(const std::filesystem::path& urdf, std::string name) {
  const std::filesystem::path folder = urdf.parent_path();
  if (name.starts_with("file://")) return {};
  for (const std::string_view scheme : {"package://", "model://"}) {
    if (!name.starts_with(scheme)) continue;
    name = name.substr(scheme.size());
    name = name.substr(name.find('/') + 1);  // all of it where there is no package
  }
  const std::filesystem::path relative(name);
  // Nothing outside of the URDF's own folder is read.
  if (relative.is_absolute() || std::ranges::find(relative, "..") != relative.end()) return {};
  return folder / relative;
}

struct Fit {
  Eigen::Isometry3d at = Eigen::Isometry3d::Identity();
  double radius_m = 0.0, length_m = 0.0;
};

// A capsule along z of `axes` that holds all corners: around the smallest circle that holds them
// across (Badoiu and Clarkson's steps), as long as those at the ends need.
Fit fit_along(const std::vector<Eigen::Vector3d>& corners, const Eigen::Matrix3d& axes) {
  constexpr int kSteps = 100;
  std::vector<Eigen::Vector3d> local;
  for (const auto& corner : corners) local.emplace_back(axes.transpose() * corner);
  Eigen::Vector2d circle = local.front().head<2>();
  const auto away = [&](const Eigen::Vector3d& corner) {
    return (corner.head<2>() - circle).norm();
  };
  for (int i = 1; i <= kSteps; ++i) {
    const auto& farthest = *std::ranges::max_element(local, {}, away);
    circle += (farthest.head<2>() - circle) / (i + 1.0);
  }
  Fit fit;
  fit.radius_m = away(*std::ranges::max_element(local, {}, away));
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
Fit fit_capsule(const std::vector<Eigen::Vector3d>& corners) {
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

Eigen::Vector3d three(const char* text, double otherwise) {
  Eigen::Vector3d value = Eigen::Vector3d::Constant(otherwise);
  std::istringstream numbers(text);
  Eigen::Vector3d read;
  if (numbers >> read.x() >> read.y() >> read.z() && read.allFinite()) value = read;
  return value;
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

void replace_mesh(pugi::xml_node collision, const std::filesystem::path& urdf) {
  pugi::xml_node geometry = collision.child("geometry");
  const pugi::xml_node mesh = geometry.child("mesh");
  const auto path = beside(urdf, mesh.attribute("filename").value());
  std::error_code ignored;
  const auto extension = path.extension();
  if ((extension != ".obj" && extension != ".OBJ") || !std::filesystem::exists(path, ignored))
    return;
  const auto text = load_file(path, {.what = "mesh", .max_bytes = kMaxMeshBytes});
  if (!text) return;
  auto corners = corners_of(*text);
  const Eigen::Vector3d scale = three(mesh.attribute("scale").value(), 1.0);
  for (auto& corner : corners) corner = corner.cwiseProduct(scale);
  if (corners.size() < 4) return;
  const Fit fit = fit_capsule(corners);
  if (!(fit.radius_m > 0.0) || fit.radius_m + fit.length_m > 1.0) return;
  pugi::xml_node origin = collision.child("origin");
  if (!origin) origin = collision.append_child("origin");
  const Eigen::Vector3d rpy = three(origin.attribute("rpy").value(), 0.0);
  Eigen::Isometry3d at = Eigen::Isometry3d::Identity();
  at.translation() = three(origin.attribute("xyz").value(), 0.0);
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
  for (pugi::xml_node link : robot.children("link")) {
    for (const char* other : {"visual", "inertial"}) {
      while (link.remove_child(other)) {
      }
    }
    for (const pugi::xml_node collision : link.children("collision")) {
      if (collision.child("geometry").child("mesh")) replace_mesh(collision, path);
    }
  }
  std::ostringstream out;
  document.save(out, "", pugi::format_raw);
  return out.str();
}

}  // namespace posed::robot
