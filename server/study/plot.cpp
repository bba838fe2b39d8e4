#include "server/study/plot.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <utility>

#include "server/study/cases.h"

extern char** environ;

namespace radbake::study {
namespace {

/// Points on a side of a panel, legend included.
constexpr int kPanelWidth = 560, kPanelHeight = 560;
/// Lines of the legend below a panel, as a share of its height.
constexpr double kLegendLine = 0.042;
constexpr std::size_t kLegendRows = 5;

/// Text in gnuplot's single quotes.
std::string quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("''") : std::string(1, c);
  return out + "'";
}

std::string number(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.9g", value);
  return text;
}

/// How curve k of a panel is drawn. Colours that differ for the colour-blind: Okabe & Ito 2008.
std::string style_of(const Curve& curve, int k) {
  static const char* const kColours[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00",
                                         "#56b4e9", "#000000", "#7f7f7f", "#882255", "#8c564b"};
  static const int kMarks[] = {7, 5, 9, 11, 13, 4, 6, 8, 7, 13};
  constexpr int kNumStyles = 10;
  if (curve.is_reference)
    return std::string("with lines lw 1.2 lc rgb '#555555' dt ") + (k % 2 == 0 ? "(12,5)" : "(3,4)");
  const std::string colour = std::string(" lw 1.6 lc rgb '") + kColours[k % kNumStyles] + "'";
  const std::string dashes = curve.is_dashed ? " dt (10,5)" : "";
  if (!curve.has_points) return "with lines" + colour + dashes;
  if (!curve.has_line) return "with points pt " + std::to_string(kMarks[k % kNumStyles]) + " ps 0.9" + colour;
  return "with linespoints pt " + std::to_string(kMarks[k % kNumStyles]) + " ps 0.6" + colour + dashes;
}

/// Tics at 1, 2 and 5 of each decade, and a range that ends just beyond the points. `axis`: 0 or 1.
std::string close_axis(const Panel& panel, std::size_t axis) {
  double low = std::numeric_limits<double>::max(), high = 0;
  for (const Curve& curve : panel.curves) {
    for (const auto& point : curve.points) {
      if (!(point[0] > 0) || !(point[1] > 0)) continue;
      low = std::min(low, point[axis]);
      high = std::max(high, point[axis]);
    }
  }
  if (!(high > 0)) return "";
  const std::string name = axis == 0 ? "x" : "y";
  std::string tics;
  for (double decade = std::pow(10.0, std::floor(std::log10(low))); decade <= high; decade *= 10) {
    for (const double step : {1.0, 2.0, 5.0}) tics += (tics.empty() ? "" : ", ") + number(step * decade);
  }
  constexpr double kMargin = 1.2;
  return "set format " + name + " '%g'\nset " + name + "tics (" + tics + ")\nset " + name + "range [" +
         number(low / kMargin) + ":" + number(high * kMargin) + "]\n";
}

std::string panel_script(const Panel& panel, int index, int num_panels) {
  std::string text;
  for (std::size_t k = 0; k < panel.curves.size(); ++k) {
    text += "$curve_" + std::to_string(index) + "_" + std::to_string(k) + " << end_of_curve\n";
    for (const auto& [x, y] : panel.curves[k].points) {
      if ((x > 0 || !panel.is_x_logarithmic) && y > 0) text += number(x) + " " + number(y) + "\n";
    }
    text += "end_of_curve\n";
  }
  text += "set origin " + number(static_cast<double>(index) / num_panels) + ", 0\n";
  text += "set size " + number(1.0 / num_panels) + ", 1\n";
  text += "set title " + quoted(panel.title) + "\nset xlabel " + quoted(panel.x_label) + "\nset ylabel " +
          quoted(panel.y_label) + "\n";
  text +=
      panel.is_x_logarithmic ? "set logscale x 10\nset format x '10^{%T}'\n" : "unset logscale x\nset format x '%g'\n";
  text += "set yrange [" + (panel.smallest_y > 0 ? number(panel.smallest_y) : std::string("*")) + ":*]\n";
  text += "set xrange [*:" + (panel.largest_x > 0 ? number(panel.largest_x) : std::string("*")) + "]\n";
  if (panel.has_close_tics) text += close_axis(panel, 0) + close_axis(panel, 1);
  // Long legends are set in two columns.
  const std::size_t rows = panel.curves.size() > kLegendRows ? (panel.curves.size() + 1) / 2 : panel.curves.size();
  text += "set key maxrows " + std::to_string(rows) + "\n";
  text += "set bmargin screen " + number(0.13 + kLegendLine * static_cast<double>(rows)) + "\n";
  std::string separator = "plot ";
  for (std::size_t k = 0; k < panel.curves.size(); ++k) {
    const Curve& curve = panel.curves[k];
    if (curve.points.empty()) continue;
    text += std::exchange(separator, ", \\\n     ") + "$curve_" + std::to_string(index) + "_" + std::to_string(k) +
            " using 1:2 title " + quoted(curve.title) + " " + style_of(curve, static_cast<int>(k));
  }
  return text + "\n";
}

std::string script_of(const Plot& plot, const std::string& stem) {
  const int n = static_cast<int>(plot.panels.size());
  const std::string size = std::to_string(kPanelWidth * n) + "," + std::to_string(kPanelHeight);
  const std::string terminals[] = {
      "set terminal svg size " + size + " dynamic font 'sans-serif,13' background rgb 'white'\nset output " +
          quoted(stem + ".svg") + "\n",
      "set terminal pngcairo size " + size + " font 'sans,11' background rgb 'white'\nset output " +
          quoted(stem + ".png") + "\n"};
  std::string text =
      "set encoding utf8\nset logscale y 10\nset format y '10^{%T}'\nset grid lc rgb '#dddddd'\n"
      "set key below left vertical Left reverse samplen 3 spacing 1.1 height 0.5\n"
      "set lmargin 11\nset rmargin 3\n";
  for (const std::string& terminal : terminals) {
    text += terminal + "set multiplot\n";
    for (int k = 0; k < n; ++k) text += panel_script(plot.panels[static_cast<std::size_t>(k)], k, n);
    text += "unset multiplot\nunset output\n";
  }
  return text;
}

/// Runs a program on one file. Errors: as draw().
Result<void> run(const std::string& program, const std::string& file) {
  int pipe_ends[2];
  if (pipe2(pipe_ends, O_CLOEXEC) != 0) return internal_error(std::string("no pipe: ") + std::strerror(errno));
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, pipe_ends[1], STDERR_FILENO);
  std::string program_copy = program, file_copy = file;
  char* const arguments[] = {program_copy.data(), file_copy.data(), nullptr};
  pid_t pid = 0;
  const int failure = posix_spawnp(&pid, program.c_str(), &actions, nullptr, arguments, environ);
  posix_spawn_file_actions_destroy(&actions);
  close(pipe_ends[1]);
  if (failure != 0) {
    close(pipe_ends[0]);
    return Error{ErrorCode::kFailedPrecondition,
                 "cannot run " + program + " (" + std::strerror(failure) + "): the plots need the package gnuplot-nox"};
  }
  std::string said;
  char bytes[1024];
  for (ssize_t n = 0; (n = read(pipe_ends[0], bytes, sizeof bytes)) > 0;)
    said.append(bytes, static_cast<std::size_t>(n));
  close(pipe_ends[0]);
  int status = 0;
  waitpid(pid, &status, 0);
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return {};
  return internal_error(program + " failed on " + file + ": " + said);
}

}  // namespace

Result<void> draw(const Plot& plot, const std::filesystem::path& folder, const std::string& name,
                  const std::string& gnuplot) {
  const std::filesystem::path stem = folder / name, script = stem.string() + ".gnuplot";
  RADBAKE_RETURN_IF_ERROR(write_text(script, script_of(plot, stem.string())));
  return run(gnuplot, script.string());
}

}  // namespace radbake::study
