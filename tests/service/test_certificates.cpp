#include "tests/service/test_certificates.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>

namespace radbake::testing {

TestCertificates::TestCertificates() {
  const std::string command = std::string(RADBAKE_MAKE_CERTIFICATES) + " " + folder_.path().string();
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
}

const TestCertificates& TestCertificates::get() {
  static const TestCertificates certificates;
  return certificates;
}

std::string TestCertificates::text(const std::string& file) const {
  std::ifstream stream(path(file), std::ios::binary);
  EXPECT_TRUE(stream.good()) << file;
  return std::string(std::istreambuf_iterator<char>(stream), {});
}

void replace_file(const std::filesystem::path& file, const std::string& text) {
  const std::filesystem::path aside = file.string() + ".new";
  std::ofstream(aside, std::ios::binary) << text;
  std::filesystem::rename(aside, file);
}

}  // namespace radbake::testing
