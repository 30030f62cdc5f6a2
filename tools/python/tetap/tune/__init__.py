# SPDX-License-Identifier: Apache-2.0
"""Noise rows of a robot from its logs, by the likelihood of the filter's innovations."""
