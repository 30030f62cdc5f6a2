# The library for somebody else's project: tetap::base up to tetap::node, and tetap::localizer as the door, with Eigen and C++20 as their only needs.
# No flag, no definition and no test goes with them. Same names from add_subdirectory() and from find_package(tetap).
# All are headers; tetap::estimators and what stands on it add one source to the program, so that its own flags hold for every line.
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)

if(NOT TARGET Eigen3::Eigen)
  find_package(Eigen3 3.4 REQUIRED NO_MODULE)
endif()

if(NOT PROJECT_IS_TOP_LEVEL)  # as find_package() sets it
  set(tetap_VERSION ${PROJECT_VERSION} PARENT_SCOPE)
endif()

set(TETAP_INCLUDE_DIR ${CMAKE_INSTALL_INCLUDEDIR}/tetap)
set(TETAP_PACKAGE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/tetap)
set(floors base filter nav model slam param sensor checks estimators)

# The messages, from their one source. What stands on them is left out where the generator cannot run.
set(generator ${PROJECT_SOURCE_DIR}/tools/can/generate_messages)
set(generated ${PROJECT_BINARY_DIR}/generated)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${generator} ${PROJECT_SOURCE_DIR}/config/tetap.dbc)
find_program(TETAP_PYTHON NAMES python3 HINTS /usr/bin NO_CMAKE_FIND_ROOT_PATH)  # Debian's own sees Debian's modules
file(MAKE_DIRECTORY ${generated}/tetap/bus)
execute_process(COMMAND ${TETAP_PYTHON} ${generator} ${PROJECT_SOURCE_DIR}/config/tetap.dbc --header ${generated}/tetap/bus/messages.hpp
                RESULT_VARIABLE failed ERROR_VARIABLE why OUTPUT_QUIET)
if(failed)
  string(STRIP "${why}" why)
  string(REGEX MATCH "[^\n]+$" why "${why}")
  message(STATUS "tetap: without tetap::bus, tetap::node and tetap::localizer, whose messages python3 with the module canmatrix makes: ${why}")
else()
  list(APPEND floors bus node localizer)
endif()

set(below Eigen3::Eigen)
foreach(floor ${floors})
  add_library(tetap_package_${floor} INTERFACE)
  add_library(tetap::${floor} ALIAS tetap_package_${floor})
  set_target_properties(tetap_package_${floor} PROPERTIES EXPORT_NAME ${floor})
  target_compile_features(tetap_package_${floor} INTERFACE cxx_std_20)
  target_include_directories(tetap_package_${floor} INTERFACE $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_link_libraries(tetap_package_${floor} INTERFACE ${below})
  set(below tetap_package_${floor})
  install(TARGETS tetap_package_${floor} EXPORT tetap)
  if(IS_DIRECTORY ${PROJECT_SOURCE_DIR}/src/tetap/${floor})
    install(DIRECTORY ${PROJECT_SOURCE_DIR}/src/tetap/${floor} DESTINATION ${TETAP_INCLUDE_DIR} FILES_MATCHING PATTERN "*.hpp" PATTERN "*.cpp")
  endif()
endforeach()
set(sources ${PROJECT_SOURCE_DIR}/src/tetap)
install(FILES ${sources}/version.hpp ${sources}/estimators.cpp DESTINATION ${TETAP_INCLUDE_DIR})
target_sources(tetap_package_estimators INTERFACE
  $<BUILD_INTERFACE:${sources}/estimators.cpp> $<INSTALL_INTERFACE:$<INSTALL_PREFIX>/${TETAP_INCLUDE_DIR}/estimators.cpp>)

if(TARGET tetap_package_localizer)
  target_include_directories(tetap_package_bus INTERFACE $<BUILD_INTERFACE:${generated}>)
  install(FILES ${generated}/tetap/bus/messages.hpp DESTINATION ${TETAP_INCLUDE_DIR}/bus)
  install(FILES ${sources}/localizer.hpp DESTINATION ${TETAP_INCLUDE_DIR})
endif()

# Below share: nothing here depends on the machine.
configure_file(${CMAKE_CURRENT_LIST_DIR}/tetap.pc.in ${PROJECT_BINARY_DIR}/tetap.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/tetap.pc DESTINATION ${CMAKE_INSTALL_DATADIR}/pkgconfig)

install(EXPORT tetap NAMESPACE tetap:: FILE tetap-targets.cmake DESTINATION ${TETAP_PACKAGE_DIR})
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/tetap-config.cmake.in ${PROJECT_BINARY_DIR}/tetap-config.cmake INSTALL_DESTINATION ${TETAP_PACKAGE_DIR})
# Before 1.0 a minor version may break a name.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/tetap-config-version.cmake COMPATIBILITY SameMinorVersion ARCH_INDEPENDENT)
install(FILES ${PROJECT_BINARY_DIR}/tetap-config.cmake ${PROJECT_BINARY_DIR}/tetap-config-version.cmake DESTINATION ${TETAP_PACKAGE_DIR})
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
