find_package(octomap REQUIRED)
find_package(Threads REQUIRED)
file(GLOB CORE CONFIGURE_DEPENDS ${PACKAGE}/src/core/*.cpp)
list(FILTER CORE EXCLUDE REGEX cloud_filters)  # needs PCL, and is asked of nothing that comes from outside
fv_fuzz_core(exploration_core SOURCES ${CORE} INCLUDES ${PACKAGE}/include ${PACKAGE}/src/core LIBRARIES ${OCTOMAP_LIBRARIES} Threads::Threads)
set_source_files_properties(${PACKAGE}/src/core/lane_kernels.cpp PROPERTIES COMPILE_OPTIONS -fno-math-errno)
fv_fuzz_target(fv_exploration insert_scan exploration_core)
fv_fuzz_target(fv_exploration map_file exploration_core)
