#pragma once

#include <sys/types.h>

#include <cstdio>
#include <string>
#include <vector>

namespace radbake::testing {

/// A radbaked that is killed at the end if it still runs.
class ServerProgram {
 public:
  /// environment: NAME=VALUE, beside our own.
  explicit ServerProgram(std::vector<std::string> arguments, const std::vector<std::string>& environment = {});
  ~ServerProgram();

  /// Reads to the line that says where it listens; "" if it ends before.
  std::string wait_for_address();
  /// Reads to the next line that holds a text, and gives what follows it there; "" if the program ends before.
  std::string wait_for(const std::string& text);
  /// Reads to its end; the status of waitpid().
  int wait();
  int end(int signal);
  void send(int signal) const;
  pid_t pid() const { return pid_; }

  /// Everything that was read, of stdout and stderr.
  const std::string& output() const { return output_text_; }

 private:
  pid_t pid_ = 0;
  FILE* output_ = nullptr;
  std::string output_text_;
};

}  // namespace radbake::testing
