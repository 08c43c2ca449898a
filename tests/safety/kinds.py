"""Kinds of decks that once gave a wrong result without a word, and the tests that hold each: for test_kinds.py.

A test is `file::function`, files from tests/ on. Whoever ends another kind adds its line here.
"""

from __future__ import annotations

CONDITIONS = "stability/test_conditions.py::"
SILENT = "stability/test_silent_rows.py::"
COILS = "unit/circuit/test_coils_at_the_start.py::"
DECKS = "decks/test_results_and_exit_codes.py::"
LEFT_OUT = "unit/circuit/test_what_lines_leave_out.py::"
SPELLED = "ngspice/test_dialects.py::"
MACHINES = "physics/mechanics/"
TURNS = f"{MACHINES}test_turns_and_assemblies.py::"
REST = f"{MACHINES}test_where_it_comes_to_rest.py::"
CHANGE = f"{MACHINES}test_change_points.py::"
SHOWN = "unit/outputs/test_what_cannot_be_shown.py::"
INCLUDES = "safety/test_includes.py::"
KILLED = "safety/test_killed_runs.py::"

KINDS: dict[str, list[str]] = {
    # conditions and switches
    "a condition whose operand arrives exactly at its threshold": [
        f"{CONDITIONS}test_a_condition_ends_where_its_operand_arrives_at_the_threshold",
        f"{CONDITIONS}test_a_capacitance_and_a_force_follow_conditions_at_their_threshold",
    ],
    "... in a phase detector": [f"{CONDITIONS}test_a_phase_detector_sees_its_clock_go_down"],
    "a negated condition, conditions made of conditions": [
        f"{CONDITIONS}test_a_condition_of_a_condition_is_what_its_text_says",
    ],
    "exclusive or by !=": [f"{CONDITIONS}test_exclusive_or_by_not_equal"],
    "a latch that holds its own output": [f"{CONDITIONS}test_a_latch_holds_its_own_output"],
    "a flag that is not what its condition says": [f"{CONDITIONS}test_a_flag_that_does_not_turn_is_told"],
    "a switch at exactly its threshold": [
        f"{CONDITIONS}test_a_switch_turns_where_its_control_arrives_at_its_threshold",
        "unit/circuit/test_switch_at_its_threshold.py::test_it_turns_where_the_control_arrives",
    ],
    "VSWITCH, also with voff above von": [
        "unit/circuit/test_smooth_switch.py::test_the_resistance_follows_the_control_both_ways",
    ],
    # starts
    "a coil across a source that does not start at 0": [
        f"{COILS}test_a_coil_across_a_source_starts_without_current",
        f"{COILS}test_a_cosine_across_a_coil_is_a_sine",
    ],
    "a tank that .ic gives a volt": [f"{COILS}test_a_tank_that_starts_with_a_volt_rings"],
    ".ic of a node that a coil shorts": [f"{COILS}test_ic_of_a_node_that_a_coil_shorts"],
    "ic= on a line without uic": [f"{LEFT_OUT}test_ic_without_uic_is_said_to_count_for_nothing"],
    "an operating point that violates the equations": [
        "stability/test_operating_points.py::test_a_steep_table_that_steps_jump_over",
        "stability/test_operating_points.py::test_what_has_no_operating_point_is_refused_with_its_card",
    ],
    "atan2 of two voltages that start at 0": [
        "stability/test_operating_points.py::test_atan2_of_two_voltages_that_start_at_zero",
    ],
    "a domain error laid to another card": [
        "stability/test_operating_points.py::test_a_domain_error_names_the_source_that_has_it",
        "messages/test_failures.py::test_a_value_out_of_a_functions_domain_is_not_laid_to_the_first_card_of_the_deck",
    ],
    # rows of transients
    "the first point behind an event": [
        f"{SILENT}test_a_coil_that_is_cut_off_does_not_turn_its_current_round"
    ],
    "Kirchhoff's law at a floating star point": [
        f"{SILENT}test_a_floating_star_point_breaks_no_current_law",
        f"{SILENT}test_a_floating_star_point_breaks_no_current_law_at_the_first_row",
    ],
    "rows beside a circuit at rest": [f"{SILENT}test_a_pulse_beside_a_circuit_at_rest_is_a_pulse"],
    "a narrow pulse of time alone": [
        f"{DECKS}test_a_narrow_pulse_charges_its_capacitor",
        f"{CONDITIONS}test_a_pulse_of_time_alone_is_not_stepped_over",
        f"{CONDITIONS}test_a_resistance_of_time_alone_is_not_stepped_over",
    ],
    "a PWL source with a capacitor on it": [f"{SILENT}test_a_source_s_node_is_its_pwl"],
    "a diode in a circuit that is not connected": [f"{SILENT}test_an_unrelated_diode_changes_nothing"],
    "the current through a junction's capacitance": [
        f"{SILENT}test_the_current_through_a_junction_s_capacitance",
    ],
    "H in a loop of capacitors": [f"{SILENT}test_what_capacitors_tie_together_may_jump_at_the_start"],
    "gear and loops of capacitors": [f"{SILENT}test_rounding_of_what_capacitors_tie_together_is_no_error"],
    "gauss and plain RC": [f"{SILENT}test_gauss_keeps_what_capacitors_have_in_common"],
    "the second derivative of what is stored": [
        f"{SILENT}test_the_voltage_of_a_coil_behind_the_current_of_a_source",
    ],
    "many rows of one step": [
        f"{SILENT}test_many_rows_of_one_step_can_be_stopped",
        f"{KILLED}test_a_limit_of_memory_is_a_message",
    ],
    # text
    "pwl() of a constant": [f"{DECKS}test_pwl_of_a_constant_goes_on_beyond_its_table_as_that_of_a_node_does"],
    "only .ac, only .dc, only what does not exist": [
        f"{DECKS}test_a_deck_of_ac_alone_computes_its_sweep",
        f"{DECKS}test_a_deck_of_dc_alone_computes_its_sweep",
        f"{DECKS}test_a_deck_of_an_analysis_that_does_not_exist_is_no_success",
        "unit/circuit/test_tran_card.py::test_other_analyses_make_one_error_each_and_the_rest_runs",
    ],
    "exponents with d, brackets of PWL, names of KiCad": [
        f"{SPELLED}test_other_spellings_whose_meaning_is_plain_are_read",
        f"{DECKS}test_a_spelling_of_the_field_has_its_value",
    ],
    ".connect, .alter, .hdl, relative times of PWL": [
        f"{SPELLED}test_what_is_not_read_is_told_with_what_to_write",
    ],
    "a value that the control section changes": [
        f"{DECKS}test_a_spelling_of_the_field_has_its_value",
        "ngspice/test_control_core.py::test_models_are_altered",
    ],
    "an incomplete set of K lines": [f"{LEFT_OUT}test_a_pair_of_windings_without_a_k_is_named"],
    "a resistor without a value": [f"{LEFT_OUT}test_a_resistor_without_a_value_is_a_milliohm"],
    "a value of a model in brackets": [f"{LEFT_OUT}test_values_of_a_model_in_brackets"],
    "Ctrl-Z, UTF-16, backslashes in paths": [
        "unit/frontend/test_source.py::test_ctrl_z_ends_an_included_file",
        "unit/frontend/test_source.py::test_utf16_without_its_mark_is_read",
        "unit/frontend/test_source.py::test_backslashes_in_the_path_of_an_include",
    ],
    "what was an internal error": [
        "safety/test_internal_errors.py::test_a_deck_that_was_an_internal_error_has_its_diagnostic",
        "safety/test_internal_errors.py::test_fmt_of_two_thousand_terms",
        "safety/test_internal_errors.py::test_damaged_files_of_results_are_read_or_refused",
    ],
    # machines
    "a driven toggle that starts stretched": [
        f"{CHANGE}test_a_driven_toggle_that_starts_stretched_is_closed_at_every_row",
        f"{CHANGE}test_a_row_left_out_that_opens_later_is_told",
    ],
    "a driven linkage that passes a change point": [
        f"{CHANGE}test_a_driven_coupling_rod_keeps_its_branch_through_the_dead_centres",
        f"{CHANGE}test_a_driven_slider_crank_of_equal_links_goes_through_its_centre",
    ],
    "the angle of a joint that closes a loop in space": [
        f"{TURNS}test_the_angle_of_the_joint_that_closes_a_loop_in_space_counts_turns",
        f"{TURNS}test_what_sits_on_that_joint_does_not_jump_either",
    ],
    "inertia of a rotor whose stator moves": [
        f"{MACHINES}test_stators_that_move.py::test_satellite_stays_at_rest_when_its_wheel_stands_in_j",
        f"{MACHINES}test_stators_that_move.py::test_rotor_speed_is_carrier_plus_gear_times_relative",
    ],
    "units in the model of a motor": [
        f"{DECKS}test_a_unit_that_does_not_fit_is_refused_in_the_model_of_a_motor",
    ],
    "loss() and energy() against the ledger": [
        "physics/test_one_bookkeeping.py::test_loss_and_energy_leave_out_what_the_circuit_does",
        "physics/test_one_bookkeeping.py::test_torque_times_speed_is_not_the_power_of_a_motor_with_friction",
    ],
    "no equilibrium where only the search failed": [
        f"{REST}test_an_open_chain_let_down_from_the_level_has_no_equilibrium",
        f"{REST}test_a_cable_between_two_hooks_has_no_equilibrium",
        f"{REST}test_an_upright_pose_is_reported_as_rest",
    ],
    "reactions that statics cannot determine": [
        f"{MACHINES}test_reactions_not_unique.py::test_a_third_support_gets_a_plain_number_by_deck_order",
    ],
    "a gap that closes": [
        f"{MACHINES}test_gaps_that_close.py::"
        "test_a_closed_gap_is_a_matter_of_capacitors_or_goes_on_with_a_negative_inductance",
    ],
    "the farther assembly": [
        f"{TURNS}test_without_a_guess_the_assembly_nearest_to_the_drawn_pose_is_taken",
    ],
    "a motion that amplifies errors": [f"{TURNS}test_a_body_that_flips_is_right_or_said_to_amplify_errors"],
    "friction, stops, contact": [
        "physics/test_friction.py::*",
        "physics/test_impacts.py::*",
        "physics/test_touch.py::*",
    ],
    # what is shown
    "a number that no scale shows": [f"{SHOWN}*"],
    "an expression of columns by its name": [f"{SHOWN}*"],
    # foreign files
    "commands of a foreign deck": ["safety/test_foreign_decks.py::test_a_foreign_deck_runs_no_command"],
    "includes that are no decks, or never end": [
        f"{INCLUDES}test_a_file_that_is_no_deck_is_not_shown",
        f"{INCLUDES}test_includes_that_double_at_every_level_end",
        f"{INCLUDES}test_a_pipe_or_a_device_is_not_included",
    ],
    "files of a run that is killed, of a disk that is full": [
        f"{KILLED}test_a_killed_run_leaves_its_rows_and_the_file_before",
        f"{KILLED}test_a_full_disk_leaves_the_file_before_and_the_rows_that_fitted",
        f"{KILLED}test_fmt_on_a_full_disk_leaves_the_deck",
    ],
    # how it cannot come back
    "invariants of every recorded row": [
        "stability/test_invariants.py::test_a_node_whose_currents_do_not_cancel_is_named",
        "stability/test_invariants.py::test_a_source_that_is_not_followed_is_named",
        "stability/test_invariants.py::test_a_loop_that_is_open_is_named",
    ],
    "linear networks against their exact solutions": [
        "stability/test_linear_networks.py::test_a_random_linear_network_is_what_its_matrix_exponential_says",
        "stability/test_linear_networks.py::test_a_loop_of_capacitors_through_sources_whose_current_is_read",
    ],
    "diodes, switches, logic against fine steps": [
        "stability/test_diode_networks.py::test_a_network_of_diodes_switches_and_logic_is_what_fine_steps_say",
        f"{CONDITIONS}test_random_networks_of_conditions_are_what_their_text_says",
    ],
    "machines against other coordinates": ["stability/test_random_machines.py::*"],
    "a parameter that changes nothing": ["unit/test_every_parameter.py::*"],
}
