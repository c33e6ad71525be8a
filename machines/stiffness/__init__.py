"""Forces in rods and drives of a machine on legs, and how far its tool yields."""
