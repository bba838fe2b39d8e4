#pragma once

#include <filesystem>
#include <string>

#include "tests/service/temporary_folder.h"

namespace radbake::testing {

/// Test authorities and certificates, made once for each test program: make_certificates says which.
class TestCertificates {
 public:
  static const TestCertificates& get();

  std::filesystem::path path(const std::string& file) const { return folder_.path() / file; }
  std::string text(const std::string& file) const;

 private:
  TestCertificates();
  TemporaryFolder folder_;
};

/// Writes a file aside and renames it over its name, as people who rotate certificates do.
void replace_file(const std::filesystem::path& file, const std::string& text);

}  // namespace radbake::testing
