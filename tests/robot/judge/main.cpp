// usage: posed_robot_judge HAND.urdf POSES.csv
// Says what is wrong with the poses by MuJoCo. The exit code is 0 if nothing is, 1 if something is.
#include <iostream>

#include "tests/robot/judge/robot_judge.hpp"

namespace {

void list(const char* what, const std::vector<std::string>& names) {
  if (names.empty()) return;
  std::cout << names.size() << " " << what << ":";
  for (const std::string& name : names) std::cout << " " << name << ";";
  std::cout << "\n";
}

int run(const char* urdf, const char* csv) {
  using namespace posed::test;
  auto judge = RobotJudge::load(urdf);
  const auto poses = read_robot_poses(csv);
  if (!judge || !poses) {
    std::cerr << (judge ? poses.error() : judge.error()).text() << "\n";
    return 2;
  }
  std::cout << judge->links() << " links, " << judge->joints() << " joints\n";
  list("links have no shape and touch nothing", judge->without_shape());
  list("meshes are missing", judge->missing_meshes());
  list("pairs touch in the start pose and are not judged", judge->touching_at_start());
  const RobotVerdict verdict = judge->judge(*poses);
  list("columns are no joints", verdict.unknown_columns);
  if (verdict.unknown_columns.size() == poses->joints.size() || verdict.frames == 0) {
    std::cerr << "no column names a joint of the hand, or there is no frame: nothing was judged\n";
    return 2;
  }
  list("joints have no column and stay", verdict.still_joints);
  std::cout << verdict.frames << " frames, " << verdict.in_contact
            << " with a contact deeper than 1 mm, " << verdict.beyond_limits << " beyond a limit\n";
  for (const auto& [links, place] : verdict.contacts) {
    std::cout << "  " << links.first << " + " << links.second << ": " << place.frames
              << " frames, at most " << place.worst * 1000.0 << " mm\n";
  }
  for (const auto& [joint, place] : verdict.limits) {
    std::cout << "  " << joint << ": " << place.frames << " frames, at most " << place.worst
              << " beyond its limit\n";
  }
  return verdict.in_contact + verdict.beyond_limits == 0 ? 0 : 1;
}

}  // namespace

int main(int count, char** arguments) {
  if (count == 3) return run(arguments[1], arguments[2]);
  std::cerr << "usage: posed_robot_judge HAND.urdf POSES.csv\n";
  return 2;
}
