# tubed_opencv(core imgproc ...): the targets opencv_core, opencv_imgproc, ... Each module is looked for by itself:
# OpenCVConfig.cmake comes with libopencv-dev alone, which brings every module and what those need, 300 packages more.
function(tubed_opencv)
  find_path(TUBED_OPENCV_INCLUDE opencv2/core.hpp PATH_SUFFIXES opencv4 REQUIRED)
  find_path(TUBED_OPENCV_BUILT_INCLUDE opencv2/opencv_modules.hpp PATH_SUFFIXES opencv4 REQUIRED)  # per architecture in Debian
  foreach(module ${ARGN})
    if(TARGET opencv_${module})
      continue()
    endif()
    find_library(TUBED_OPENCV_${module} opencv_${module} REQUIRED)
    add_library(opencv_${module} UNKNOWN IMPORTED GLOBAL)
    set_target_properties(opencv_${module} PROPERTIES IMPORTED_LOCATION ${TUBED_OPENCV_${module}}
                          INTERFACE_INCLUDE_DIRECTORIES "${TUBED_OPENCV_INCLUDE};${TUBED_OPENCV_BUILT_INCLUDE}")
  endforeach()
endfunction()
