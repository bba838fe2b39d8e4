#pragma once

#include <sys/types.h>

#include <cstdio>
#include <string>
#include <vector>

namespace radbake::testing {

/// A radbaked that is killed at the end if it still runs.
class Program {
 public:
  explicit Program(std::vector<std::string> arguments);
  ~Program();
  Program(const Program&) = delete;

  /// Reads to the line that says where it listens; "" if it ends before.
  std::string wait_for_address();
  /// Its status, as waitpid() tells it.
  int wait();
  int end(int signal);
  /// All that it printed until then.
  const std::string& output() const { return output_text_; }
  pid_t pid() const { return pid_; }

 private:
  pid_t pid_ = 0;
  FILE* output_ = nullptr;
  std::string output_text_;
};

}  // namespace radbake::testing
