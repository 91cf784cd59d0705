# Finds the OpenCV modules that the nodes use. Sets OpenCV_INCLUDE_DIRS and defines the targets
# opencv_core, opencv_imgproc, opencv_imgcodecs, opencv_videoio and opencv_calib3d.
#
# Debian ships OpenCVConfig.cmake only in libopencv-dev, which brings every module and 60 MB more
# than these five. Without that file this module looks for the headers and libraries themselves.
set(modules core imgproc imgcodecs videoio calib3d)
find_package(OpenCV 4.6 QUIET CONFIG COMPONENTS ${modules})
if(NOT OpenCV_FOUND)
  find_path(OpenCV_INCLUDE_DIRS opencv2/core.hpp PATH_SUFFIXES opencv4 REQUIRED)
  foreach(module ${modules})
    find_path(opencv_${module}_include opencv2/${module}.hpp PATHS ${OpenCV_INCLUDE_DIRS} REQUIRED)
    find_library(opencv_${module}_library opencv_${module} REQUIRED)
    add_library(opencv_${module} UNKNOWN IMPORTED)
    set_target_properties(opencv_${module} PROPERTIES
      IMPORTED_LOCATION ${opencv_${module}_library}
      INTERFACE_INCLUDE_DIRECTORIES ${OpenCV_INCLUDE_DIRS})
  endforeach()
endif()
