"""What a machine is good for: condition number, transmission, reachable box."""
