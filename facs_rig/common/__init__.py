"""The ground floor: what every package may use, and what uses nothing of ours."""
