#include "server/service/cost_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "common/base/version.h"

namespace radbake::service {
namespace {

class CostFileTest : public ::testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void write(const std::string& text) const { std::ofstream(path_) << text; }
  std::string read() const {
    std::ifstream file(path_);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("radbake-costs-" + std::to_string(::getpid()));
  const std::filesystem::path path_ = folder_ / "costs.txt";
};

v1::HostCosts rays_of(double seconds) {
  v1::HostCosts costs;
  costs.set_row_ray(seconds);
  costs.set_texel_ray(2 * seconds);
  return costs;
}

TEST_F(CostFileTest, KeepsTheFirstCostsAndThenAveragesThem) {
  CostFile file(path_);
  EXPECT_EQ(file.costs().row_ray(), 0);
  file.add(rays_of(1e-6));
  EXPECT_EQ(file.costs().row_ray(), 1e-6);
  EXPECT_EQ(file.costs().light_ray(), 0);
  file.add(rays_of(2e-6));
  EXPECT_DOUBLE_EQ(file.costs().row_ray(), 1.3e-6);
  EXPECT_DOUBLE_EQ(file.costs().texel_ray(), 2.6e-6);
  EXPECT_EQ(CostFile(path_).costs().SerializeAsString(), file.costs().SerializeAsString());
}

TEST_F(CostFileTest, LeavesOutWhatIsNoCost) {
  CostFile file(path_);
  file.add(rays_of(1e-6));
  for (const double bad : {0.0, -1.0, 2.0, std::nan(""), HUGE_VAL}) file.add(rays_of(bad));
  EXPECT_EQ(file.costs().row_ray(), 1e-6);
}

TEST_F(CostFileTest, HoldsNothingWhereTheFileIsBrokenOrOfAnotherVersion) {
  CostFile(path_).add(rays_of(1e-6));
  const std::string good = read();
  ASSERT_EQ(CostFile(path_).costs().row_ray(), 1e-6);
  const std::string version = kEngineVersion;
  for (const std::string& bad :
       {std::string(), std::string("radbake costs 0.0.0-other\nrow_ray: 1e-06\n"),
        "radbake costs " + version + "\nrow_ray: quick\n", "radbake costs " + version + "\nrow_ray: -1\n",
        "radbake costs " + version + "\nrow_ray: nan\n", good.substr(0, good.size() - 12),
        std::string("\0\xff\n", 3)}) {
    write(bad);
    EXPECT_EQ(CostFile(path_).costs().texel_ray(), 0) << bad;
  }
  // What is there is written over by the next bake.
  CostFile(path_).add(rays_of(3e-6));
  EXPECT_EQ(CostFile(path_).costs().row_ray(), 3e-6);
}

TEST_F(CostFileTest, GoesOnWithoutAFileThatCanBeWritten) {
  CostFile file(folder_ / "missing" / "costs.txt");
  file.add(rays_of(1e-6));
  EXPECT_EQ(file.costs().row_ray(), 1e-6);
}

}  // namespace
}  // namespace radbake::service
