#pragma once

#include <string>

#include "server/study/accuracy_study.h"
#include "server/study/plot.h"

namespace radbake::study {

/// axis,value,rays,spacing,light_samples,max_patches,form_factors,solver,target,budget,pass,cpu_seconds,seconds,
/// difference,error,stated_error
std::string accuracy_csv(const AccuracyStudy& study);

/// Error over CPU seconds with the Pareto front, and true error over the error that bakes state.
Plot accuracy_plot(const AccuracyStudy& study);

/// What to use when, in words, with the numbers of this study. `picture`: the plot's file, as the page is to name it.
std::string accuracy_page(const AccuracyStudy& study, const std::string& picture);

}  // namespace radbake::study
