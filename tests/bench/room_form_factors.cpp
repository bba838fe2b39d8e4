#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "server/radiosity/form_factor/analytic_rows.h"
#include "server/radiosity/survey/survey.h"
#include "tests/scenes/rooms.h"

/// Form factors of a unit room, n x n patches a face, with a half-size cube of m x m patches a face inside: how long
/// all rows take and how far they are from closed, and beside it the same by View3D, where a path to it is given.

namespace radbake {
namespace {

using radiosity::AnalyticEstimator;

struct Closure {
  std::size_t num_patches = 0;
  double cpu_seconds = 0;
  double row_error = 0;  ///< the largest |sum of a row - 1|, raw
  double stated = -1;    ///< the largest that is stated; < 0: none
  double aggregate = 0;  ///< from the whole floor to the whole ceiling
};

void print(const std::string& name, const Closure& r) {
  std::printf("%-24s %6zu %9.3f %12.2e", name.c_str(), r.num_patches, r.cpu_seconds, r.row_error);
  if (r.stated >= 0) {
    std::printf(" %12.2e", r.stated);
  } else {
    std::printf(" %12s", "-");
  }
  std::printf(" %14.10f\n", r.aggregate);
}

double cpu_seconds(int who) {
  rusage usage;
  getrusage(who, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

/// Floor first, ceiling second.
Scene room_with_cube(bool has_cube) {
  tests::RoomBuilder builder(8);
  const int material = builder.add_material("wall", {0.5, 0.5, 0.5}, {1, 1, 1});
  const Vec3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
  builder.add_quad("floor", {0, 0, 0}, x, y, material);
  builder.add_quad("ceiling", z, y, x, material);
  builder.add_quad("x low", {0, 0, 0}, y, z, material);
  builder.add_quad("x high", x, z, y, material);
  builder.add_quad("y low", {0, 0, 0}, z, x, material);
  builder.add_quad("y high", y, x, z, material);
  if (has_cube) builder.add_box("cube", {0.25, 0.25, 0.25}, {0.75, 0.75, 0.75}, material, false);
  return std::move(builder.scene());
}

Closure measure(int n, bool has_cube, double tolerance) {
  const Scene scene = room_with_cube(has_cube);
  const radiosity::SurveyedScene surveyed = radiosity::survey_scene(scene).value();
  const auto visibility = radiosity::make_embree_visibility(surveyed.surfaces.corners);
  const radiosity::Patches patches =
      radiosity::make_patches(surveyed.surfaces, *visibility, {1 / (n * surveyed.surfaces.metres_per_unit), 16384});

  // All rows, the preparation of polygons included.
  const double start = cpu_seconds(RUSAGE_SELF);
  const AnalyticEstimator estimator(surveyed.surfaces, patches, *visibility, tolerance);
  const auto scratch = estimator.make_scratch();
  std::vector<radiosity::FormFactorRow> rows(patches.size());
  std::vector<std::uint8_t> is_buried;
  for (std::uint32_t i = 0; i < patches.size(); ++i) estimator.estimate(i, {}, 0, *scratch, {}, rows[i], is_buried);
  Closure result{patches.size(), cpu_seconds(RUSAGE_SELF) - start, 0, 0, 0};

  const auto num_floor = static_cast<std::uint32_t>(n * n);
  for (std::uint32_t i = 0; i < rows.size(); ++i) {
    double sum = 0;
    for (const auto& [patch, weight] : rows[i].entries) {
      sum += weight / rows[i].counted;
      if (i < num_floor && patch >= num_floor && patch < 2 * num_floor) {
        result.aggregate += weight / rows[i].counted / num_floor;
      }
    }
    result.row_error = std::max(result.row_error, std::abs(sum - 1));
    result.stated = std::max(result.stated, rows[i].stated_error);
  }
  return result;
}

/// View3D's input: vertices, then surfaces, their corners as it wants them, clockwise seen from the front.
void write_input(const std::filesystem::path& path, int n, int m, double epsilon) {
  std::ofstream vertices_and_surfaces(path);
  std::ostringstream surfaces;
  vertices_and_surfaces << "T room\nC eps=" << epsilon << " encl=0 list=0\nF 3\n";
  int num_vertices = 0, num_surfaces = 0;
  const auto add_face = [&](Vec3 origin, Vec3 s, Vec3 t, int k) {
    for (int j = 0; j < k; ++j) {
      for (int i = 0; i < k; ++i) {
        surfaces << "S " << ++num_surfaces;
        for (const auto& [u, v] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}}) {
          const Vec3 p = origin + s * ((i + u) / static_cast<double>(k)) + t * ((j + v) / static_cast<double>(k));
          vertices_and_surfaces << "V " << ++num_vertices << " " << p.x << " " << p.y << " " << p.z << "\n";
          surfaces << " " << num_vertices;
        }
        surfaces << " 0 0 0.5 s" << num_surfaces << "\n";
      }
    }
  };
  const auto add_box = [&](double low, double size, int k, bool faces_in) {
    const Vec3 o{low, low, low}, x{size, 0, 0}, y{0, size, 0}, z{0, 0, size};
    const auto add = [&](Vec3 origin, Vec3 s, Vec3 t) {
      faces_in ? add_face(origin, s, t, k) : add_face(origin, t, s, k);
    };
    add(o, x, y), add(o + z, y, x), add(o, y, z), add(o + x, z, y), add(o, z, x), add(o + y, x, z);
  };
  add_box(0, 1, n, true);
  if (m > 0) add_box(0.25, 0.5, m, false);
  vertices_and_surfaces << surfaces.str() << "End of data\n";
}

/// Runs a program in a folder; its CPU seconds, or < 0 where it fails.
double run(const std::filesystem::path& program, const std::filesystem::path& folder, const std::string& input,
           const std::string& output) {
  const double before = cpu_seconds(RUSAGE_CHILDREN);
  std::fflush(stdout);
  const pid_t child = fork();
  if (child == 0) {
    if (chdir(folder.c_str()) != 0 || std::freopen("log", "w", stdout) == nullptr ||
        std::freopen("errors", "w", stderr) == nullptr)
      _exit(126);
    execl(program.c_str(), program.c_str(), input.c_str(), output.c_str(), nullptr);
    _exit(127);
  }
  int status = 0;
  if (child < 0 || waitpid(child, &status, 0) != child || !WIFEXITED(status) || WEXITSTATUS(status) >= 126) return -1;
  return cpu_seconds(RUSAGE_CHILDREN) - before;
}

/// Reads View3D's table: a line of heading, areas, a row of form factors for each surface.
bool measure_peer(const std::filesystem::path& program, int n, int m, double epsilon, Closure& result) {
  std::string name = (std::filesystem::temp_directory_path() / "radbake-room-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) return false;
  const std::filesystem::path folder = name;
  write_input(folder / "room.vs3", n, m, epsilon);
  const double seconds = run(std::filesystem::absolute(program), folder, "room.vs3", "room.out");
  std::ifstream file(folder / "room.out");
  std::string line;
  std::getline(file, line);
  const std::size_t size = 6 * static_cast<std::size_t>(n * n + m * m), num_floor = static_cast<std::size_t>(n * n);
  result = {size, seconds, 0, -1, 0};
  double value = 0;
  for (std::size_t k = 0; k < size; ++k) file >> value;
  for (std::size_t i = 0; i < size; ++i) {
    double sum = 0;
    for (std::size_t j = 0; j < size; ++j) {
      file >> value;
      sum += value;
      if (i < num_floor && j >= num_floor && j < 2 * num_floor)
        result.aggregate += value / static_cast<double>(num_floor);
    }
    result.row_error = std::max(result.row_error, std::abs(sum - 1));
  }
  const bool is_read = seconds >= 0 && !file.fail();
  std::filesystem::remove_all(folder);
  return is_read;
}

}  // namespace
}  // namespace radbake

int main(int argc, char** argv) {
  CLI::App app("Form factors of a unit room with a cube inside: seconds and closure of all rows");
  int n = 8;
  std::string peer;
  std::vector<double> tolerances = {1e-6, 1e-7}, epsilons = {1e-4, 1e-6};
  app.add_option("--patches", n, "Patches along an edge of the room; half as many along the cube's")
      ->check(CLI::PositiveNumber & CLI::TypeValidator<int>());
  app.add_option("--tolerance", tolerances, "Of one form factor");
  app.add_option("--peer", peer, "Path of a View3D program, which runs on the same rooms")->check(CLI::ExistingFile);
  app.add_option("--peer-epsilon", epsilons, "What View3D is asked for");
  CLI11_PARSE(app, argc, argv);

  std::printf("%-24s %6s %9s %12s %12s %14s\n", "", "N", "CPU s", "row error", "stated", "floor->ceiling");
  for (const bool has_cube : {false, true}) {
    std::printf("%s\n", has_cube ? "with a cube (exact 0.0746164860)" : "empty (exact 0.1998248957)");
    for (const double tolerance : tolerances) {
      std::ostringstream name;
      name << "radbake, " << tolerance;
      radbake::print(name.str(), radbake::measure(n, has_cube, tolerance));
    }
    for (const double epsilon : epsilons) {
      if (peer.empty()) continue;
      std::ostringstream name;
      name << "View3D, eps " << epsilon;
      radbake::Closure result;
      if (!radbake::measure_peer(peer, n, has_cube ? n / 2 : 0, epsilon, result)) {
        std::fprintf(stderr, "%s: no form factors from it\n", peer.c_str());
        return 1;
      }
      radbake::print(name.str(), result);
    }
  }
  return 0;
}
